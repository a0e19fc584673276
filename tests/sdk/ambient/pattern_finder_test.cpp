// SPDX-License-Identifier: Apache-2.0
// Proves that the pattern is found from six frames for every usual pattern and phase, with weak
// stripes, motion, texture, lost frames and interlaced fields, and that an empty scene or a laser
// that is always on is not mistaken for a pattern. The scenes are synthetic; what a real street
// does is measured on simulated frames elsewhere.
#include "ambient/illumination/pattern_finder.hpp"

#include <gtest/gtest.h>

#include <striper/ambient/fields.hpp>

#include "support/street.hpp"

namespace striper {
namespace {

using detail::PatternFinder;

using testing::Street;

void show(PatternFinder& finder, const Frame& frame) {
  if (!frame.is_interlaced()) {
    finder.add(frame, frame.exposure_number());
    return;
  }
  for (const Frame& field : split_fields(frame)) finder.add(field, field.exposure_number());
}

PatternFinder::Finding find_in(Street& street, const std::vector<std::uint64_t>& frames,
                               int lasers = 1) {
  testing::reseed();
  street.build();
  PatternFinder finder(StripeAxis::kColumns, lasers);
  for (const std::uint64_t sequence : frames) show(finder, street.frame(sequence));
  return finder.find();
}

const std::vector<std::uint64_t> kSixFrames{0, 1, 2, 3, 4, 5};

// The pattern that a person would write, turned so that exposure 0 comes first.
std::string darkness(const IlluminationPattern& pattern, std::uint64_t exposures = 12) {
  std::string text;
  for (std::uint64_t n = 0; n < exposures; ++n) text += pattern.at(n).is_dark() ? '-' : '*';
  return pattern.is_automatic() ? "none" : text;
}

class EveryPattern : public ::testing::TestWithParam<const char*> {};

TEST_P(EveryPattern, IsFoundInSixFrames) {
  Street street;
  street.pattern = IlluminationPattern::parse(GetParam());
  EXPECT_EQ(darkness(find_in(street, kSixFrames).pattern), darkness(street.pattern));
}

TEST_P(EveryPattern, IsFoundWhileEverythingMoves) {
  Street street;
  street.pattern = IlluminationPattern::parse(GetParam());
  street.speed_px = 37.0;
  street.amplitude_dn = 80.0;  // Boxes as bright as the stripe jump about.
  street.texture_dn = 10.0;
  street.edge_dn = 60.0;
  EXPECT_EQ(darkness(find_in(street, kSixFrames).pattern), darkness(street.pattern));
}

TEST_P(EveryPattern, IsFoundInInterlacedFields) {
  Street street;
  street.pattern = IlluminationPattern::parse(GetParam());
  street.field = Field::kInterlacedTopFirst;
  street.edge_dn = 60.0;
  street.speed_px = 3.0;
  EXPECT_EQ(darkness(find_in(street, kSixFrames).pattern), darkness(street.pattern));
}

TEST_P(EveryPattern, IsFoundWithFramesLost) {
  Street street;
  street.pattern = IlluminationPattern::parse(GetParam());
  // A third of them gone, then a burst.
  const std::vector<std::uint64_t> arrived{0, 2, 3, 5, 6, 7, 18, 20};
  EXPECT_EQ(darkness(find_in(street, arrived).pattern), darkness(street.pattern));
}

TEST_P(EveryPattern, IsFoundForAWeakStripe) {
  Street street;
  street.pattern = IlluminationPattern::parse(GetParam());
  street.amplitude_dn = 6.0;  // Three sigmas a pixel.
  EXPECT_EQ(darkness(find_in(street, kSixFrames).pattern), darkness(street.pattern));
}

INSTANTIATE_TEST_SUITE_P(PatternFinder, EveryPattern,
                         ::testing::Values("0,dark", "dark,0", "0,0,dark", "0,dark,dark",
                                           "dark,0,0", "0,0,0,dark", "0,0,dark,dark"));

TEST(PatternFinder, SeveralLasersAreNumberedAfterTheDarkExposure) {
  Street street;
  street.pattern = IlluminationPattern::parse("0,1,2,dark");
  EXPECT_EQ(find_in(street, kSixFrames, 3).pattern, street.pattern);
}

TEST(PatternFinder, LaserThatFiresTwiceKeepsItsNumber) {
  Street street;
  street.pattern = IlluminationPattern::parse("0,0,1,dark");
  EXPECT_EQ(find_in(street, kSixFrames, 2).pattern, street.pattern);
}

TEST(PatternFinder, EmptySceneShowsNoPattern) {
  for (const double speed : {0.0, 3.0, 37.0}) {
    Street street;
    street.amplitude_dn = 0.0;
    street.speed_px = speed;
    street.edge_dn = 60.0;
    const auto finding = find_in(street, kSixFrames);
    EXPECT_TRUE(finding.pattern.is_automatic())
        << finding.pattern.to_string() << ' ' << finding.surplus << " at " << speed;
    EXPECT_FALSE(finding.always_lit);
  }
}

TEST(PatternFinder, EmptyFieldsShowNoPattern) {
  for (const double speed : {0.0, 3.0, 37.0}) {
    Street street;
    street.amplitude_dn = 0.0;
    street.speed_px = speed;
    street.edge_dn = 60.0;
    street.field = Field::kInterlacedBottomFirst;
    const auto finding = find_in(street, kSixFrames);
    EXPECT_TRUE(finding.pattern.is_automatic())
        << finding.pattern.to_string() << ' ' << finding.surplus << " at " << speed;
  }
}

TEST(PatternFinder, LaserThatIsAlwaysOnIsNoPattern) {
  Street street;
  street.pattern = IlluminationPattern::parse("0");
  street.texture_dn = 2.0;
  const auto finding = find_in(street, kSixFrames);
  EXPECT_TRUE(finding.pattern.is_automatic());
  EXPECT_TRUE(finding.always_lit);
}

// As before a sensor in someone's hand.
TEST(PatternFinder, StripeThatJumpsIsNoPattern) {
  for (const bool is_always_lit : {true, false}) {
    testing::reseed();
    Street street;
    street.pattern = IlluminationPattern::parse(is_always_lit ? "0" : "0,dark");
    street.build();
    double row = 0.0;
    street.row = [&row](int, int) { return row; };
    PatternFinder finder(StripeAxis::kColumns, 1);
    for (const std::uint64_t sequence : kSixFrames) {
      row = 20.0 + 13.0 * static_cast<double>(sequence);
      show(finder, street.frame(sequence));
    }
    EXPECT_EQ(finder.find().pattern.is_automatic(), is_always_lit);
    EXPECT_EQ(finder.shows_lines_in_dark(IlluminationPattern::parse("0,dark")), is_always_lit);
    EXPECT_FALSE(finder.shows_lines_in_dark(IlluminationPattern()));
  }
}

TEST(PatternFinder, OneInterlacedFrameIsEnough) {
  Street street;
  street.pattern = IlluminationPattern::parse("dark,0");
  street.field = Field::kInterlacedTopFirst;
  EXPECT_EQ(find_in(street, {0}).pattern, street.pattern);
}

TEST(PatternFinder, OneExposureShowsNothing) {
  Street street;
  EXPECT_TRUE(find_in(street, {0}).pattern.is_automatic());
}

std::optional<double> disorder(Field true_order, Field given_order, double speed_px) {
  testing::reseed();
  Street street;
  street.field = true_order;
  street.speed_px = speed_px;
  street.edge_dn = 60.0;
  street.build();
  PatternFinder finder(StripeAxis::kColumns);
  for (const std::uint64_t sequence : kSixFrames) {
    Frame frame = street.frame(sequence);
    frame.field = given_order;
    show(finder, frame);
  }
  return finder.field_disorder();
}

TEST(FieldDisorder, TellsTheRightOrderFromTheWrongOne) {
  constexpr Field kTop = Field::kInterlacedTopFirst;
  constexpr Field kBottom = Field::kInterlacedBottomFirst;
  for (const double speed : {1.0, 2.0, 4.0, 8.0, 16.0, 30.0}) {
    EXPECT_LT(disorder(kTop, kTop, speed).value(), 0.2) << speed;
    EXPECT_LT(disorder(kBottom, kBottom, speed).value(), 0.2) << speed;
    EXPECT_GT(disorder(kTop, kBottom, speed).value(), 0.4) << speed;
    EXPECT_GT(disorder(kBottom, kTop, speed).value(), 0.4) << speed;
  }
}

TEST(FieldDisorder, IsUnknownWhereNothingMoves) {
  EXPECT_FALSE(disorder(Field::kInterlacedTopFirst, Field::kInterlacedBottomFirst, 0.0));
}

}  // namespace
}  // namespace striper
