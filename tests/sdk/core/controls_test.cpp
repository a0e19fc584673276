// SPDX-License-Identifier: Apache-2.0
// Proves that a table of rows is a source's controls: what is listed, got and set, that every error
// names control, value and range, and that values survive being text. What sources do with them is
// in their own tests.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/controls.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A device of two numbers: one in steps of 5, one that can only be read; one that it lacks.
struct Device {
  double exposure_us = 20.0;
  Controls controls{
      "test:device",
      {{"exposure_us", ControlType::kNumber, "us",
        [this] {
          return ControlState{{exposure_us}, {5.0}, {1000.0}};
        },
        [this](const ControlValue& v) { exposure_us = 5.0 * std::round(v[0] / 5.0); }},
       {"laser", ControlType::kSwitch, "",
        [] {
          return ControlState{{1.0}, {0.0}, {1.0}};
        },
        [](const ControlValue&) {}},
       {"region", ControlType::kRegion, "px",
        [] {
          return ControlState{{0, 0, 640, 480}, {0, 0, 640, 480}, {0, 0, 640, 480}};
        },
        nullptr},
       {"gain_db", ControlType::kNumber, "dB", [] { return ControlState{}; }, nullptr}}};
};

TEST(Controls, AreListedGotAndSetAndReadBack) {
  Device device;
  const std::vector<Control> all = device.controls.list();
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].name, "exposure_us");
  EXPECT_EQ(all[0].unit, "us");
  EXPECT_TRUE(all[0].state.is_writable);
  EXPECT_FALSE(all[2].state.is_writable);
  EXPECT_THAT(all[2].state.value, ElementsAre(0, 0, 640, 480));
  EXPECT_THAT(device.controls.set("exposure_us", {101.0}).state.value, ElementsAre(100.0));
  EXPECT_THAT(device.controls.get("exposure_us").state.value, ElementsAre(100.0));
}

TEST(Controls, ErrorsNameControlValueAndRange) {
  Device device;
  const auto error = [&](const char* name, const ControlValue& value) {
    return testing::error_of([&] { device.controls.set(name, value); });
  };
  EXPECT_EQ(error("exposure_us", {1001.0}).kind(), ErrorKind::kBadValue);
  EXPECT_THAT(error("exposure_us", {1001.0}).what(),
              HasSubstr("'test:device': exposure_us=1001 - expected 5 to 1000 us"));
  EXPECT_THAT(error("exposure_us", {NAN}).what(), HasSubstr("exposure_us=nan - expected 5 to"));
  EXPECT_THAT(error("exposure_us", {}).what(), HasSubstr("expected 5 to 1000 us"));
  EXPECT_THAT(error("laser", {0.5}).what(), HasSubstr("expected on or off"));
  EXPECT_EQ(error("region", {0, 0, 1, 1}).kind(), ErrorKind::kUnsupported);
  EXPECT_THAT(error("region", {0, 0, 1, 1}).what(),
              HasSubstr("region=0,0,1,1 - it cannot be set now; it is 0,0,640,480"));
  for (const char* const absent : {"gain_db", "zoom"}) {
    EXPECT_EQ(error(absent, {1.0}).kind(), ErrorKind::kUsage);
    EXPECT_THAT(error(absent, {1.0}).what(), HasSubstr("'test:device' has no control"));
  }
  Controls none;
  EXPECT_TRUE(none.list().empty());
  EXPECT_THAT(testing::error_of([&] { none.get("laser"); }).what(),
              HasSubstr("has no controls, so no 'laser'"));
}

TEST(Controls, ValuesSurviveBeingText) {
  const auto again = [](ControlType type, const std::string& text) {
    return format_control(type, parse_control(type, text));
  };
  EXPECT_EQ(again(ControlType::kNumber, "0.1"), "0.1");
  EXPECT_EQ(again(ControlType::kSwitch, "on"), "on");
  EXPECT_EQ(again(ControlType::kSwitch, "off"), "off");
  EXPECT_EQ(again(ControlType::kRegion, "0,8,640,32"), "0,8,640,32");
  EXPECT_EQ(again(ControlType::kPose, "1,-2.5,3,0,0,1e-300"), "1,-2.5,3,0,0,1e-300");
  for (const auto& [type, text] :
       std::vector<std::pair<ControlType, std::string>>{{ControlType::kNumber, "1,2"},
                                                        {ControlType::kNumber, ""},
                                                        {ControlType::kNumber, "nan"},
                                                        {ControlType::kSwitch, "1"},
                                                        {ControlType::kRegion, "0,0,1"},
                                                        {ControlType::kRegion, "0,0,1,1,"},
                                                        {ControlType::kPose, "1,2,3,4,5"}}) {
    const Error error =
        testing::error_of([&, type = type, text = text] { parse_control(type, text); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
    EXPECT_THAT(error.what(), HasSubstr("'" + text + "' - expected "));
  }
}

}  // namespace
}  // namespace striper
