// SPDX-License-Identifier: Apache-2.0
// Proves that a source that is lost and opened again, and goes on anywhere in the pattern, is
// scanned once the images show where, and that it is said where they do not. The scenes are
// synthetic.
#include <functional>
#include <string>
#include <utility>

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
using Pair = testing::StagePair;
using Pairs = testing::StagePairs;

struct Reopened {
  Pairs before;
  Pairs after;
  AmbientStatus status;
  std::vector<Event> events;
};

Reopened reopen(
    const char* pattern, const char* pattern_after, double amplitude_after_dn = 40.0,
    const std::function<void(Frame&)>& change = [](Frame&) {}) {
  testing::reseed();
  Street street;
  street.build();
  const testing::Heard heard;
  AmbientOptions options = with_pattern(pattern);
  options.events = heard.port();
  AmbientStage stage(options);
  Reopened result;
  const auto push_all = [&](std::uint64_t first, std::uint64_t count, const char* lit, Pairs& pairs,
                            bool is_told) {
    street.pattern = IlluminationPattern::parse(lit);
    for (std::uint64_t sequence = first; sequence < first + count; ++sequence) {
      Frame frame = street.frame(sequence);
      frame.illumination = is_told ? street.pattern.at(sequence) : Illumination::unknown();
      if (!is_told) change(frame);
      stage.push(frame);
      take(stage, pairs);
    }
  };
  push_all(0, 20, pattern, result.before, true);
  street.amplitude_dn = amplitude_after_dn;
  push_all(60, 24, pattern_after, result.after, false);
  // And a second time, in the first phase again.
  street.amplitude_dn = 40.0;
  push_all(120, 24, pattern, result.after, false);
  stage.finish();
  take(stage, result.after);
  result.status = stage.status();
  result.events = heard.events();
  return result;
}

TEST(ReopenedSource, PhaseIsFoundAgainWhereTheSourceDoesNotKnowIt) {
  for (const auto& [given, after] : {std::pair{"0,dark", "dark,0"}, std::pair{"0,dark", "0,dark"},
                                     std::pair{"0,0,dark", "dark,0,0"}}) {
    SCOPED_TRACE(::testing::Message() << given << ", then " << after);
    const Reopened reopened = reopen(given, after);
    const std::size_t lit_part = given == std::string("0,dark") ? 2 : 3;
    EXPECT_GE(reopened.after.size(), 48 * (lit_part - 1) / lit_part - 3);
    for (const Pair& pair : reopened.after) {
      const bool is_after = pair.lit >= 60 && pair.lit < 120;
      const IlluminationPattern truth = IlluminationPattern::parse(is_after ? after : given);
      EXPECT_TRUE(truth.at(pair.lit).is_lit()) << pair.lit;
    }
    EXPECT_EQ(reopened.status.origin, PatternOrigin::kPhase);
    EXPECT_THAT(reopened.events, Not(has_event("pattern_lost")));
  }
}

// A source that never knew what lights its frames says only that it began anew.
TEST(ReopenedSource, PhaseOfAnotherEpochIsFoundAgain) {
  for (const char* const given : {"0,dark", "auto"}) {
    testing::reseed();
    Street street;
    street.build();
    AmbientStage stage(with_pattern(given));
    Pairs pairs;
    for (std::uint64_t sequence = 0; sequence < 40; ++sequence) {
      if (sequence == 20) street.pattern = IlluminationPattern::parse("dark,0");
      Frame frame = street.frame(sequence);
      frame.epoch = sequence < 20 ? 0 : 1;
      stage.push(frame);
      take(stage, pairs);
    }
    stage.finish();
    take(stage, pairs);
    EXPECT_GE(pairs.size(), 18U) << given;
    for (const Pair& pair : pairs) EXPECT_EQ(pair.lit % 2, pair.lit < 20 ? 0U : 1U) << given;
  }
}

TEST(ReopenedSource, NothingIsScannedWhereThePhaseCannotBeFound) {
  const Reopened reopened = reopen("0,dark", "dark,0", 0.0);
  EXPECT_EQ(reopened.before.size(), 10U);
  for (const Pair& pair : reopened.after) {
    EXPECT_GE(pair.lit, 120U);
    EXPECT_EQ(pair.lit % 2, 0U);
  }
  EXPECT_GE(reopened.after.size(), 9U);
  EXPECT_THAT(reopened.events, has_event("pattern_lost"));
}

TEST(ReopenedSource, SourceThatKnowsThePhaseAgainIsBelieved) {
  const Reopened reopened = reopen("0,dark", "dark,0", 40.0, [](Frame& frame) {
    const bool is_second = frame.sequence >= 120;
    if (is_second) frame.illumination = IlluminationPattern::parse("0,dark").at(frame.sequence);
  });
  EXPECT_EQ(reopened.status.pattern, IlluminationPattern::parse("0,dark"));
  EXPECT_EQ(reopened.status.origin, PatternOrigin::kGiven);
  for (const Pair& pair : reopened.after) EXPECT_EQ(pair.lit % 2, pair.lit < 120 ? 1U : 0U);
}

}  // namespace
}  // namespace striper
