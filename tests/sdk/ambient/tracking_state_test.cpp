// SPDX-License-Identifier: Apache-2.0
// Proves the ways from one phase of illumination tracking to another.
#include "ambient/illumination/tracking_state.hpp"

#include <gtest/gtest.h>

namespace striper::detail {
namespace {

using enum TrackingSignal;

TEST(TrackingState, SearchesThenLocks) {
  TrackingState state(Teller::kImages);
  EXPECT_EQ(state.phase(), TrackingPhase::kSearching);
  EXPECT_FALSE(state.is_settled());
  state.on(kSettled);
  EXPECT_EQ(state.phase(), TrackingPhase::kLocked);
  EXPECT_TRUE(state.is_settled());
  state.on(kRestarted);
  EXPECT_EQ(state.phase(), TrackingPhase::kSearching);
}

TEST(TrackingState, SuspectsOnlyWhatItHadLocked) {
  TrackingState state(Teller::kImages);
  state.on(kRefuted);
  EXPECT_EQ(state.phase(), TrackingPhase::kSearching);
  state.on(kSettled);
  state.on(kRefuted);
  EXPECT_EQ(state.phase(), TrackingPhase::kSuspect);
  state.on(kUnfounded);
  EXPECT_EQ(state.phase(), TrackingPhase::kSearching);
}

TEST(TrackingState, FollowsWhatWasGivenUntilFramesSayOtherwise) {
  TrackingState state(Teller::kGiven);
  state.on(kSettled);
  EXPECT_EQ(state.phase(), TrackingPhase::kGiven);
  state.on(kRefuted);
  EXPECT_EQ(state.phase(), TrackingPhase::kGiven);
  state.on(kLabelsHeard);
  EXPECT_EQ(state.phase(), TrackingPhase::kLocked);
  EXPECT_FALSE(state.is_given());
  EXPECT_TRUE(state.is_of_frames());
}

TEST(TrackingState, LosesItsPlaceAndFindsIt) {
  for (const Teller teller : {Teller::kGiven, Teller::kFrames}) {
    TrackingState state(teller);
    state.on(kSettled);
    state.on(kPlaceLost);
    EXPECT_EQ(state.phase(), TrackingPhase::kLost);
    EXPECT_TRUE(state.has_no_place());
    EXPECT_EQ(state.was_of_frames(), teller == Teller::kFrames);
    state.on(kSettled);
    EXPECT_EQ(state.phase(), TrackingPhase::kLocked);
    state.on(kRefuted);
    EXPECT_EQ(state.phase(), TrackingPhase::kSuspect);
    state.on(kUnfounded);
    EXPECT_EQ(state.phase(), TrackingPhase::kLost);
    state.on(kLabelsHeard);
    EXPECT_TRUE(state.is_of_frames());
    EXPECT_EQ(state.phase(), TrackingPhase::kSearching);
  }
}

}  // namespace
}  // namespace striper::detail
