// SPDX-License-Identifier: Apache-2.0
// Proves that a cadence reads its text form, refuses nonsense by name, and repeats with gaps
// counted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/cadence.hpp>
#include <striper/core/error.hpp>
#include <striper/core/frame.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

TEST(Cadence, RepeatsItsPatternOverExposureNumbers) {
  const Cadence cadence = Cadence::parse("0,1,2,dark");
  EXPECT_EQ(cadence.at(0), Illumination::laser(0));
  EXPECT_EQ(cadence.at(6), Illumination::laser(2));
  EXPECT_EQ(cadence.at(7), Illumination::dark());
  EXPECT_TRUE(cadence.has_dark());
}

TEST(Cadence, LostPictureDoesNotFlipTheParityOfFields) {
  const Cadence cadence = Cadence::parse("0,dark");
  Frame second_field;
  second_field.sequence = 41;  // Whatever was lost before it.
  second_field.exposure_in_picture = 1;
  second_field.exposures_per_picture = 2;
  EXPECT_EQ(cadence.at(second_field.exposure_number()), Illumination::dark());
}

TEST(Cadence, AutomaticKnowsNothing) {
  EXPECT_TRUE(Cadence::parse("auto").is_automatic());
  EXPECT_EQ(Cadence().at(3), Illumination::unknown());
}

TEST(Cadence, TextFormReadsBack) {
  for (const char* text :
       {"auto", "0", "0,dark", "2,1,dark,0", "0@20,dark@20,0@200,dark@200", "0@0.1,0@1.25"}) {
    EXPECT_EQ(Cadence::parse(text).to_string(), text);
    EXPECT_EQ(Cadence::parse(Cadence::parse(text).to_string()), Cadence::parse(text));
  }
}

TEST(Cadence, RefusesNonsenseQuotingIt) {
  for (const char* text : {"", "0,", "0,,1", "lit", "-1", "64", "0 ,1", "0.5", "0@", "0@0", "0@-3",
                           "0@20us", "0@1e10"}) {
    SCOPED_TRACE(text);
    const Error error = testing::error_of([&] { Cadence::parse(text); });
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    EXPECT_THAT(error.what(), HasSubstr(std::string("'") + text + "'"));
  }
}

TEST(Cadence, BracketSaysHowLongEachExposureIs) {
  const Cadence bracket = Cadence::parse("0@20,dark@20,0@200,dark@200");
  EXPECT_TRUE(bracket.is_bracket());
  EXPECT_EQ(bracket.exposure_us_at(1), 20.0);
  EXPECT_EQ(bracket.exposure_us_at(6), 200.0);
  EXPECT_EQ(bracket.at(6), Illumination::laser(0));
  EXPECT_FALSE(Cadence::parse("0,dark").is_bracket());
  EXPECT_EQ(Cadence::parse("0,dark").exposure_us_at(1), 0.0);
}

TEST(Cadence, RefusesExposuresOfSomeEntriesOnly) {
  EXPECT_THROW(Cadence::parse("0@20,dark"), Error);
  EXPECT_THROW(Cadence({Illumination::laser(0)}, {20.0, 200.0}), Error);
  EXPECT_THROW(Cadence({Illumination::laser(0)}, {0.0}), Error);
}

TEST(Cadence, RefusesAPatternThatIsNeverLit) {
  EXPECT_THROW(Cadence::parse("dark"), Error);
  EXPECT_THROW(Cadence({Illumination::laser(0), Illumination::unknown()}), Error);
}

}  // namespace
}  // namespace striper
