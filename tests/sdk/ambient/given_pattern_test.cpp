// SPDX-License-Identifier: Apache-2.0
// Proves that a pattern that was given and is wrong is reported, on whole frames as on fields,
// whatever else passes by, and that a right one never is. The scenes are synthetic.
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/ambient/ambient_stage.hpp>

#include "support/ambient_account.hpp"

namespace striper {
namespace {

using testing::has_event;
using ::testing::Not;
using testing::Street;

// Whatever is wrong with a pattern that was given.
auto complaint() {
  return ::testing::AnyOf(has_event("pattern_contradicted"), has_event("pattern_unseen"),
                          has_event("always_lit"));
}

std::vector<Event> events_on(
    const Street& street, const char* given, std::uint64_t frames = 8,
    const std::function<void(Frame&)>& change = [](Frame&) {}) {
  AmbientOptions options;
  options.pattern = IlluminationPattern::parse(given);
  return testing::account_of(street, options, frames, change).events;
}

// Past boxes, and at so many pixels an exposure that nothing is where it was.
std::vector<Street> streets(const char* pattern, Field field) {
  std::vector<Street> all(2);
  all[0].speed_px = 3.0;
  all[0].edge_dn = 30.0;
  all[1].speed_px = 37.0;
  all[1].amplitude_dn = 80.0;
  all[1].texture_dn = 10.0;
  for (Street& street : all) {
    testing::reseed();
    street.size = {160, 240};
    street.pattern = IlluminationPattern::parse(pattern);
    street.field = field;
    street.build();
  }
  return all;
}

class GivenPattern : public ::testing::TestWithParam<Field> {};

TEST_P(GivenPattern, WrongOneIsReported) {
  for (const char* const truth : {"0,dark", "0,dark,dark"}) {
    for (const Street& street : streets(truth, GetParam())) {
      for (const char* const given : {"0", "dark,0", "0,dark,dark", "0,0,dark"}) {
        if (std::string(given) == truth) continue;
        SCOPED_TRACE(::testing::Message()
                     << truth << ", given " << given << ", speed " << street.speed_px);
        // What is less than plain must be seen twice.
        EXPECT_THAT(events_on(street, given, 12), complaint());
      }
    }
  }
}

TEST_P(GivenPattern, RightOneNeverIs) {
  for (const char* const truth : {"0", "0,dark", "dark,0", "0,dark,dark,dark,dark"}) {
    for (const Street& street : streets(truth, GetParam())) {
      SCOPED_TRACE(::testing::Message() << truth << ", speed " << street.speed_px);
      EXPECT_THAT(events_on(street, truth, 24), Not(complaint()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AmbientStage, GivenPattern,
                         ::testing::Values(Field::kProgressive, Field::kInterlacedTopFirst));

TEST(GivenPattern, LaserThatIsAlwaysOnRefutesDarkExposures) {
  Street street;
  street.pattern = IlluminationPattern::parse("0");
  street.texture_dn = 2.0;
  testing::reseed();
  street.build();
  EXPECT_THAT(events_on(street, "0,dark"), has_event("always_lit"));
}

TEST(GivenPattern, DarkExposuresThatNothingTellsFromLitOnesAreReported) {
  Street street;
  street.amplitude_dn = 0.0;
  testing::reseed();
  street.build();
  EXPECT_THAT(events_on(street, "0,dark", 24), has_event("pattern_unseen"));
  EXPECT_THAT(events_on(street, "0", 24), Not(complaint()));
}

// Six frames are one look, and so are eight.
TEST(GivenPattern, OneLookMustDoForAFewFrames) {
  for (const std::uint64_t frames : {6U, 8U, 12U}) {
    testing::reseed();
    Street street;
    street.amplitude_dn = 0.0;
    street.build();
    EXPECT_THAT(events_on(street, "0,dark", frames), has_event("pattern_unseen"));
    EXPECT_THAT(events_on(street, "0", frames), Not(complaint()));
    street.amplitude_dn = 4.0;  // Too faint to be plain.
    street.pattern = IlluminationPattern::parse("0,0,dark");
    for (const char* const given : {"0,dark", "0", "dark,0,0"}) {
      EXPECT_THAT(events_on(street, given, frames), complaint()) << given << ' ' << frames;
    }
    EXPECT_THAT(events_on(street, "0,0,dark", frames), Not(complaint()));
  }
}

// An empty street first, then one with a stripe.
TEST(GivenPattern, IsAskedForUntilThereIsSomethingToSee) {
  for (const char* const given : {"0", "dark,0"}) {
    testing::reseed();
    Street street;
    street.build();
    AmbientOptions options;
    options.pattern = IlluminationPattern::parse(given);
    const testing::Heard heard;
    options.events = heard.port();
    AmbientStage stage(options);
    for (std::uint64_t sequence = 0; sequence < 60; ++sequence) {
      street.amplitude_dn = sequence < 20 ? 0.0 : 40.0;
      stage.push(street.frame(sequence));
      while (stage.next() != nullptr) {
      }
    }
    EXPECT_THAT(heard.events(), has_event("pattern_contradicted")) << given;
  }
}

// A frame that is lost without being counted makes a right pattern a wrong one.
TEST(GivenPattern, ThatSlipsIsReported) {
  testing::reseed();
  Street street;
  street.build();
  const auto lose_one = [&](Frame& frame) {
    if (frame.sequence < 20) return;
    frame = street.frame(frame.sequence + 1);
    --frame.sequence;
  };
  EXPECT_THAT(events_on(street, "0,dark", 40), Not(complaint()));
  EXPECT_THAT(events_on(street, "0,dark", 40, lose_one), has_event("pattern_contradicted"));
}

// What a source knows of its frames is no pattern that somebody gave.
TEST(GivenPattern, FramesThatKnowTheirLightAreBelieved) {
  testing::reseed();
  Street street;
  street.build();
  const auto know = [&](Frame& frame) { frame.illumination = street.pattern.at(frame.sequence); };
  EXPECT_THAT(events_on(street, "0,dark", 12, know), Not(complaint()));
}

}  // namespace
}  // namespace striper
