// SPDX-License-Identifier: Apache-2.0
// Proves that every option of a scanner has a name, help and a default that reads back, that what
// is put is got, and that what an option cannot be is refused with its name and what it may be.
#include <cctype>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/pipeline/scanner_option.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

TEST(ScannerOption, HasANameOfItsOwnAndHelp) {
  std::set<std::string_view> names;
  for (const ScannerOption& option : scanner_options()) {
    SCOPED_TRACE(option.name);
    EXPECT_TRUE(names.insert(option.name).second);
    EXPECT_THAT(std::string(option.name), MatchesRegex("[a-z]+(_[a-z]+)*"));
    EXPECT_FALSE(option.help.empty());
    EXPECT_FALSE(option.help.ends_with("."));
    EXPECT_EQ(option.is_number(), !option.unit.empty());
    EXPECT_EQ(find_scanner_option(option.name), &option);
  }
  EXPECT_EQ(find_scanner_option("min-range"), find_scanner_option("min_range"));
  EXPECT_EQ(find_scanner_option("colour"), nullptr);
}

TEST(ScannerOption, DefaultsReadBack) {
  for (const ScannerOption& option : scanner_options()) {
    const std::string value = option.get(ScannerOptions{});
    if (value.empty()) continue;  // Nothing is set.
    EXPECT_EQ(option.why_not(value), "") << option.name;
    ScannerOptions options;
    option.put(options, value);
    EXPECT_EQ(option.get(options), value) << option.name;
  }
}

TEST(ScannerOption, WhatIsPutIsGot) {
  for (const ScannerOption& option : scanner_options()) {
    std::vector<std::string> values{"0.25", "0.5"};
    if (!option.is_number()) values.assign(option.words.begin(), option.words.end());
    for (const std::string& value : values) {
      ScannerOptions options;
      set_scanner_option(options, option.name, value);
      EXPECT_EQ(option.get(options), value) << option.name;
    }
  }
}

TEST(ScannerOption, RegionIsFourWholeNumbers) {
  ScannerOptions options;
  set_scanner_option(options, "region", "8,16,320,200");
  EXPECT_EQ(options.region, cv::Rect(8, 16, 320, 200));
  EXPECT_EQ(find_scanner_option("region")->get(options), "8,16,320,200");
  for (const char* const value :
       {"", "8,16,320", "8,16,320,200,1", "8,16,0,200", "-1,0,5,5", "a,b,c,d"}) {
    EXPECT_THAT(find_scanner_option("region")->why_not(value), HasSubstr("is no X,Y,W,H")) << value;
  }
}

TEST(ScannerOption, WhatItCannotBeIsRefused) {
  ScannerOptions options;
  const auto refusal = [&](const char* name, const char* value) {
    return std::string(testing::error_of([&] { set_scanner_option(options, name, value); }).what());
  };
  EXPECT_EQ(refusal("axis", "u"), "axis: 'u' is none of columns, rows");
  EXPECT_EQ(refusal("width", "0"), "width: '0' is no number above 0");
  EXPECT_EQ(refusal("width", "inf"), "width: 'inf' is no number above 0");
  EXPECT_EQ(refusal("min-confidence", "1.5"), "min_confidence: '1.5' is no probability, 0 to 1");
  for (const char* const value : {"", "nan", "3x", "1 2"}) {
    EXPECT_THAT(refusal("threshold", value), HasSubstr("is no number")) << value;
  }
  EXPECT_THAT(refusal("colour", "red"), HasSubstr("option 'colour' is none of method, peak"));
}

}  // namespace
}  // namespace striper
