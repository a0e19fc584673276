// SPDX-License-Identifier: Apache-2.0
// Proves that a stage that was not told the pattern holds what comes until it has found it, scans
// all of it then, and doubts and finds it again where the images show another one. The scenes are
// synthetic.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/ambient/ambient_stage.hpp>

#include "support/heard.hpp"
#include "support/stage_pairs.hpp"
#include "support/street.hpp"

namespace striper {
namespace {

using testing::has_event;
using ::testing::Not;
using testing::Street;
using testing::take;
using testing::with_pattern;
using Pairs = testing::StagePairs;

TEST(FoundPattern, HeldFramesAreAllScannedOnceThePatternIsFound) {
  testing::reseed();
  Street street;
  street.pattern = IlluminationPattern::parse("dark,0");
  street.build();
  AmbientStage stage{AmbientOptions{}};
  Pairs pairs;
  for (std::uint64_t sequence = 0; sequence < 5; ++sequence) {
    stage.push(street.frame(sequence));
    take(stage, pairs);
  }
  EXPECT_TRUE(pairs.empty());
  EXPECT_EQ(stage.status().phase, TrackingPhase::kSearching);
  stage.push(street.frame(5));
  take(stage, pairs);
  stage.finish();
  take(stage, pairs);
  ASSERT_EQ(pairs.size(), 3U);
  EXPECT_EQ(pairs[0].lit, 1U);
  EXPECT_EQ(pairs[2].lit, 5U);
  EXPECT_EQ(stage.status().pattern, IlluminationPattern::parse("dark,0"));
  EXPECT_EQ(stage.status().origin, PatternOrigin::kFound);
  EXPECT_EQ(stage.status().phase, TrackingPhase::kLocked);
  EXPECT_EQ(stage.status().method, AmbientMethod::kAlternate);
}

TEST(FoundPattern, EmptySceneIsScannedAndThePatternFoundWhenThereIsSomethingToSee) {
  testing::reseed();
  Street street;
  street.build();
  AmbientStage stage{AmbientOptions{}};
  Pairs pairs;
  for (std::uint64_t sequence = 0; sequence < 80; ++sequence) {
    street.amplitude_dn = sequence < 20 ? 0.0 : 40.0;
    stage.push(street.frame(sequence));
    take(stage, pairs);
    if (sequence == 19) {
      EXPECT_EQ(pairs.size(), 20U);
    }
  }
  EXPECT_EQ(stage.status().pattern, IlluminationPattern::parse("0,dark"));
  EXPECT_EQ(stage.status().origin, PatternOrigin::kFound);
  EXPECT_EQ(pairs.back().lit, 78U);
}

TEST(FoundPattern, RestartOfTheSourceFindsThePatternAgain) {
  testing::reseed();
  Street street;
  street.build();
  AmbientStage stage{AmbientOptions{}};
  Pairs pairs;
  for (std::uint64_t sequence = 0; sequence < 8; ++sequence) {
    stage.push(street.frame(sequence));
    take(stage, pairs);
  }
  const std::size_t before = pairs.size();
  EXPECT_EQ(before, 4U);
  street.pattern = IlluminationPattern::parse("dark,0");
  for (std::uint64_t sequence = 0; sequence < 8; ++sequence) {
    stage.push(street.frame(sequence));
    take(stage, pairs);
  }
  stage.finish();
  take(stage, pairs);
  ASSERT_EQ(pairs.size(), before + 4);
  for (std::size_t i = before; i < pairs.size(); ++i) EXPECT_EQ(pairs[i].lit % 2, 1U);
}

TEST(FoundPattern, WrongPatternIsReported) {
  testing::reseed();
  Street street;
  street.build();
  const testing::Heard heard;
  AmbientOptions options = with_pattern("dark,0");
  options.events = heard.port();
  AmbientStage stage(options);
  for (std::uint64_t sequence = 0; sequence < 8; ++sequence) {
    stage.push(street.frame(sequence));
    while (stage.next() != nullptr) {
    }
  }
  EXPECT_THAT(heard.events(), has_event("pattern_contradicted"));
}

TEST(FoundPattern, WrongFieldOrderIsReported) {
  testing::reseed();
  Street street;
  street.field = Field::kInterlacedTopFirst;
  street.speed_px = 4.0;
  street.edge_dn = 60.0;
  street.build();
  for (const bool is_wrong : {false, true}) {
    const testing::Heard heard;
    AmbientOptions options;
    options.events = heard.port();
    AmbientStage stage{options};
    for (std::uint64_t sequence = 0; sequence < 8; ++sequence) {
      Frame frame = street.frame(sequence);
      if (is_wrong) frame.field = Field::kInterlacedBottomFirst;
      stage.push(frame);
      while (stage.next() != nullptr) {
      }
    }
    if (is_wrong) {
      EXPECT_THAT(heard.events(), has_event("field_order"));
    } else {
      EXPECT_THAT(heard.events(), Not(has_event("field_order")));
    }
  }
}

// Frames whose source does not count those that it loses.
struct SilentLoss {
  std::vector<std::uint64_t> scanned;  // True numbers.
  std::vector<Event> events;
  std::uint64_t unpaired = 0;
};

SilentLoss scan_with_loss(const char* pattern, std::uint64_t lost, std::uint64_t count) {
  testing::reseed();
  Street street;
  street.pattern = IlluminationPattern::parse(pattern);
  street.speed_px = 3.0;
  street.texture_dn = 8.0;
  street.build();
  const testing::Heard heard;
  AmbientOptions options;
  options.events = heard.port();
  AmbientStage stage{options};
  std::vector<std::uint64_t> true_number;
  SilentLoss result;
  const auto take_true = [&] {
    while (const LitFrame* const lit = stage.next()) {
      result.scanned.push_back(true_number[lit->sequence]);
    }
  };
  for (std::uint64_t number = 0; number < count; ++number) {
    if (number == lost) continue;
    Frame frame = street.frame(number);
    frame.sequence = true_number.size();
    true_number.push_back(number);
    stage.push(frame);
    take_true();
  }
  stage.finish();
  take_true();
  result.events = heard.events();
  result.unpaired = stage.status().unpaired;
  return result;
}

TEST(FoundPattern, LossThatNobodyCountsIsNoticedBeforeAScanIsMadeOfIt) {
  constexpr std::uint64_t kCount = 30;
  for (const char* const pattern : {"0,dark", "0,dark,dark"}) {
    for (const std::uint64_t lost : {12U, 13U, 14U}) {
      SCOPED_TRACE(::testing::Message() << pattern << ", lost " << lost);
      const SilentLoss loss = scan_with_loss(pattern, lost, kCount);
      const IlluminationPattern parsed = IlluminationPattern::parse(pattern);
      std::size_t lit = 0;
      for (std::uint64_t n = 0; n < kCount; ++n) lit += parsed.at(n).is_lit() ? 1 : 0;
      for (const std::uint64_t number : loss.scanned) {
        EXPECT_TRUE(parsed.at(number).is_lit()) << number;
      }
      EXPECT_GE(loss.scanned.size() + 4, lit);
      EXPECT_THAT(loss.events, has_event("pattern_slipped"));
    }
  }
}

// A laser that is switched from every other frame to always on while the stripe wanders: what
// was found is refuted, and the images show no exposure that is dark.
TEST(FoundPattern, RefutedPatternGivesWayToALaserThatIsAlwaysOn) {
  constexpr std::uint64_t kSwitched = 12;
  constexpr std::uint64_t kCount = 30;
  testing::reseed();
  Street street;
  street.texture_dn = 4.0;
  street.build();
  std::uint64_t now = 0;
  street.row = [&now](int, int) { return 40.0 + 13.0 * static_cast<double>(now % 12); };
  AmbientStage stage{AmbientOptions{}};
  std::vector<std::uint64_t> scanned;
  for (now = 0; now < kCount; ++now) {
    street.pattern = IlluminationPattern::parse(now < kSwitched ? "0,dark" : "0");
    stage.push(street.frame(now));
    while (const LitFrame* const lit = stage.next()) scanned.push_back(lit->sequence);
  }
  stage.finish();
  while (const LitFrame* const lit = stage.next()) scanned.push_back(lit->sequence);
  EXPECT_EQ(stage.status().pattern, IlluminationPattern::parse("0"));
  EXPECT_EQ(stage.status().origin, PatternOrigin::kAssumed);
  std::size_t after = 0;
  for (const std::uint64_t sequence : scanned) {
    if (sequence < kSwitched) {
      EXPECT_EQ(sequence % 2, 0U);
    }
    if (sequence > kSwitched) ++after;
  }
  EXPECT_GE(after, kCount - kSwitched - 4);
}

TEST(FoundPattern, NothingLostIsNoSlip) {
  const SilentLoss none = scan_with_loss("0,0,dark", 1000, 30);
  EXPECT_EQ(none.scanned.size(), 20U);
  EXPECT_THAT(none.events, Not(has_event("pattern_slipped")));
  EXPECT_EQ(none.unpaired, 0U);
}

}  // namespace
}  // namespace striper
