// SPDX-License-Identifier: Apache-2.0
// Proves which methods go with which patterns, and what is said of those that do not.
#include <gtest/gtest.h>

#include <striper/ambient/ambient_options.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

AmbientOptions options_with(AmbientMethod method, const char* pattern) {
  AmbientOptions options;
  options.method = method;
  options.pattern = IlluminationPattern::parse(pattern);
  return options;
}

TEST(AmbientOptions, MethodsAreCalledAsOnTheCommandLine) {
  EXPECT_EQ(to_string(AmbientMethod::kAuto), "auto");
  EXPECT_EQ(to_string(AmbientMethod::kNone), "none");
  EXPECT_EQ(to_string(AmbientMethod::kAlternate), "alternate");
  EXPECT_EQ(to_string(AmbientMethod::kFields), "fields");
  EXPECT_EQ(to_string(AmbientMethod::kTemporal), "temporal");
}

TEST(AmbientOptions, MethodsThatCompareNeedADarkExposureOrAPatternYetToBeFound) {
  for (const auto method : {AmbientMethod::kAlternate, AmbientMethod::kFields}) {
    for (const char* const pattern : {"auto", "0,dark", "0,1,dark", "dark,0"}) {
      EXPECT_NO_THROW(options_with(method, pattern).validate()) << to_string(method) << pattern;
    }
    for (const char* const pattern : {"0", "0,1"}) {
      const AmbientOptions options = options_with(method, pattern);
      EXPECT_EQ(testing::error_of([&] { options.validate(); }).kind(), ErrorKind::kBadValue);
    }
  }
}

TEST(AmbientOptions, OtherMethodsGoWithEveryPattern) {
  for (const auto method : {AmbientMethod::kAuto, AmbientMethod::kNone, AmbientMethod::kTemporal}) {
    for (const char* const pattern : {"auto", "0", "0,1", "0,dark"}) {
      EXPECT_NO_THROW(options_with(method, pattern).validate()) << to_string(method) << pattern;
    }
  }
}

TEST(AmbientOptions, RefusalSaysWhatToGive) {
  const AmbientOptions options = options_with(AmbientMethod::kFields, "0,1");
  EXPECT_STREQ(testing::error_of([&] { options.validate(); }).what(),
               "ambient method fields needs dark exposures and the pattern '0,1' has none: give "
               "for example laser=0,dark, or use ambient none");
}

}  // namespace
}  // namespace striper
