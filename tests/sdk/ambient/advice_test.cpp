// SPDX-License-Identifier: Apache-2.0
// Proves that the ambient stage says what it chose and what is wrong with what was asked of it:
// nothing subtracted, always lit, whole or interlaced frames, rows that are never dark, a scene
// that moves. What it says of a pattern that was given is in given_pattern_test.cpp.
#include <functional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/ambient_account.hpp"

namespace striper {
namespace {

using testing::has_event;
using ::testing::Not;
using testing::Street;

std::vector<Event> events_on(
    Street& street, const AmbientOptions& options,
    const std::function<void(Frame&)>& change = [](Frame&) {}) {
  testing::reseed();
  street.build();
  return testing::account_of(street, options, 12, change).events;
}

AmbientOptions with_method(AmbientMethod method) {
  AmbientOptions options;
  options.method = method;
  return options;
}

TEST(Advice, AutoSaysThatItSawNoLaserAndTakesNothingOff) {
  Street street;
  street.amplitude_dn = 0.0;
  street.field = Field::kInterlacedBottomFirst;
  const std::vector<Event> said = events_on(street, {});
  EXPECT_THAT(said, has_event("no_dark_exposure"));
}

TEST(Advice, LaserThatIsPlainlyAlwaysOnNeedsNone) {
  Street street;
  street.pattern = IlluminationPattern::parse("0");
  street.texture_dn = 2.0;
  EXPECT_THAT(events_on(street, {}), Not(has_event("no_dark_exposure")));
  EXPECT_THAT(events_on(street, with_method(AmbientMethod::kAlternate)), has_event("always_lit"));
}

TEST(Advice, FieldsOfWholeFramesAreMissed) {
  Street street;
  const std::vector<Event> said = events_on(street, with_method(AmbientMethod::kFields));
  EXPECT_THAT(said, has_event("not_two_fields"));
  EXPECT_THAT(said, Not(has_event("woven_fields")));
}

TEST(Advice, InterlacedFramesTakenForWholeOnesAreRecognised) {
  Street street;
  street.texture_dn = 8.0;
  street.field = Field::kInterlacedBottomFirst;
  const auto as_whole = [](Frame& frame) {
    frame.field = Field::kProgressive;
    frame.exposures_per_picture = 1;
  };
  for (const double speed_px : {0.0, 6.0}) {
    street.speed_px = speed_px;
    EXPECT_THAT(events_on(street, {}, as_whole), has_event("woven_fields"));
  }
}

TEST(Advice, AlternateOfFieldsThatAreNeverDarkSaysSo) {
  Street street;
  street.field = Field::kInterlacedTopFirst;
  const std::vector<Event> said = events_on(street, with_method(AmbientMethod::kAlternate));
  EXPECT_THAT(said, has_event("rows_never_dark"));
}

TEST(Advice, TemporalOfASceneThatMovesSaysSo) {
  Street street;
  street.pattern = IlluminationPattern::parse("0");
  street.texture_dn = 1.5 * street.noise_dn;  // A fainter one is not noticed.
  for (const double speed_px : {0.0, 5.0}) {
    street.speed_px = speed_px;
    const std::vector<Event> said = events_on(street, with_method(AmbientMethod::kTemporal));
    const auto complaint = has_event("scene_moves");
    if (speed_px > 0.0) {
      EXPECT_THAT(said, complaint);
    } else {
      EXPECT_THAT(said, Not(complaint));
    }
  }
}

}  // namespace
}  // namespace striper
