// SPDX-License-Identifier: Apache-2.0
// Proves that a pattern reads its text form, refuses nonsense by name, and repeats with gaps
// counted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

TEST(IlluminationPattern, RepeatsItsPatternOverExposureNumbers) {
  const IlluminationPattern pattern = IlluminationPattern::parse("0,1,2,dark");
  EXPECT_EQ(pattern.at(0), Illumination::laser(0));
  EXPECT_EQ(pattern.at(6), Illumination::laser(2));
  EXPECT_EQ(pattern.at(7), Illumination::dark());
  EXPECT_TRUE(pattern.has_dark());
}

TEST(IlluminationPattern, LostFrameDoesNotFlipTheParityOfFields) {
  const IlluminationPattern pattern = IlluminationPattern::parse("0,dark");
  Frame second_field;
  second_field.sequence = 41;  // Whatever was lost before it.
  second_field.exposure_in_picture = 1;
  second_field.exposures_per_picture = 2;
  EXPECT_EQ(pattern.at(second_field.exposure_number()), Illumination::dark());
}

TEST(IlluminationPattern, AutomaticKnowsNothing) {
  EXPECT_TRUE(IlluminationPattern::parse("auto").is_automatic());
  EXPECT_EQ(IlluminationPattern().at(3), Illumination::unknown());
}

TEST(IlluminationPattern, TextFormReadsBack) {
  for (const char* text :
       {"auto", "0", "0,dark", "2,1,dark,0", "0@20,dark@20,0@200,dark@200", "0@0.1,0@1.25"}) {
    EXPECT_EQ(IlluminationPattern::parse(text).to_string(), text);
    EXPECT_EQ(IlluminationPattern::parse(IlluminationPattern::parse(text).to_string()),
              IlluminationPattern::parse(text));
  }
}

TEST(IlluminationPattern, RefusesNonsenseQuotingIt) {
  for (const char* text : {"", "0,", "0,,1", "lit", "-1", "64", "0 ,1", "0.5", "0@", "0@0", "0@-3",
                           "0@20us", "0@1e10"}) {
    SCOPED_TRACE(text);
    const Error error = testing::error_of([&] { IlluminationPattern::parse(text); });
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    EXPECT_THAT(error.what(), HasSubstr(std::string("'") + text + "'"));
  }
}

TEST(IlluminationPattern, BracketSaysHowLongEachExposureIs) {
  const IlluminationPattern bracket = IlluminationPattern::parse("0@20,dark@20,0@200,dark@200");
  EXPECT_TRUE(bracket.is_bracket());
  EXPECT_EQ(bracket.exposure_us_at(1), 20.0);
  EXPECT_EQ(bracket.exposure_us_at(6), 200.0);
  EXPECT_EQ(bracket.at(6), Illumination::laser(0));
  EXPECT_FALSE(IlluminationPattern::parse("0,dark").is_bracket());
  EXPECT_EQ(IlluminationPattern::parse("0,dark").exposure_us_at(1), 0.0);
}

TEST(IlluminationPattern, RefusesExposuresOfSomeEntriesOnly) {
  EXPECT_THROW(IlluminationPattern::parse("0@20,dark"), Error);
  EXPECT_THROW(IlluminationPattern({Illumination::laser(0)}, {20.0, 200.0}), Error);
  EXPECT_THROW(IlluminationPattern({Illumination::laser(0)}, {0.0}), Error);
}

TEST(IlluminationPattern, RefusesAPatternThatIsNeverLit) {
  EXPECT_THROW(IlluminationPattern::parse("dark"), Error);
  EXPECT_THROW(IlluminationPattern({Illumination::laser(0), Illumination::unknown()}), Error);
}

}  // namespace
}  // namespace striper
