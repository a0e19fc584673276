// SPDX-License-Identifier: Apache-2.0
// Proves that the ambient stage says what it chose and what is wrong with what was asked of it:
// nothing taken off, always lit, whole or woven pictures, rows that are never dark, a scene that
// moves. What it says of a cadence that was given is in given_cadence_test.cpp.
#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/decisions_on.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::Street;

std::string decisions_on(
    Street& street, const AmbientOptions& options,
    const std::function<void(Frame&)>& change = [](Frame&) {}) {
  testing::reseed();
  street.build();
  return testing::decisions_on(street, options, 12, change);
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
  const std::string said = decisions_on(street, {});
  EXPECT_THAT(said, HasSubstr("no exposure without the laser could be told from the others"));
  EXPECT_THAT(said, HasSubstr("say laser=0 if it is always on"));
  EXPECT_THAT(said, HasSubstr("laser=0,dark"));
}

TEST(Advice, LaserThatIsPlainlyAlwaysOnNeedsNone) {
  Street street;
  street.cadence = Cadence::parse("0");
  street.texture_dn = 2.0;
  EXPECT_THAT(decisions_on(street, {}), Not(HasSubstr("could be told")));
  EXPECT_THAT(decisions_on(street, with_method(AmbientMethod::kAlternate)),
              HasSubstr("ambient alternate needs exposures without the laser"));
}

TEST(Advice, FieldsOfWholePicturesAreMissed) {
  Street street;
  const std::string said = decisions_on(street, with_method(AmbientMethod::kFields));
  EXPECT_THAT(said, HasSubstr("ambient fields needs pictures of two fields"));
  EXPECT_THAT(said, HasSubstr("fields=split-top"));
  EXPECT_THAT(said, Not(HasSubstr("look woven")));
}

TEST(Advice, WovenPicturesTakenForWholeOnesAreRecognised) {
  Street street;
  street.texture_dn = 8.0;
  street.field = Field::kInterlacedBottomFirst;
  const auto as_whole = [](Frame& frame) {
    frame.field = Field::kProgressive;
    frame.exposures_per_picture = 1;
  };
  for (const double speed_px : {0.0, 6.0}) {
    street.speed_px = speed_px;
    EXPECT_THAT(decisions_on(street, {}, as_whole), HasSubstr("look woven of two fields"));
  }
}

TEST(Advice, AlternateOfFieldsThatAreNeverDarkSaysSo) {
  Street street;
  street.field = Field::kInterlacedTopFirst;
  const std::string said = decisions_on(street, with_method(AmbientMethod::kAlternate));
  EXPECT_THAT(said, HasSubstr("a field that is lit is never dark"));
}

TEST(Advice, TemporalOfASceneThatMovesSaysSo) {
  Street street;
  street.cadence = Cadence::parse("0");
  street.texture_dn = 1.5 * street.noise_dn;  // A fainter one is not noticed.
  for (const double speed_px : {0.0, 5.0}) {
    street.speed_px = speed_px;
    const std::string said = decisions_on(street, with_method(AmbientMethod::kTemporal));
    const auto complaint = HasSubstr("ambient temporal is for a sensor that stands still");
    if (speed_px > 0.0) {
      EXPECT_THAT(said, complaint);
    } else {
      EXPECT_THAT(said, Not(complaint));
    }
  }
}

}  // namespace
}  // namespace striper
