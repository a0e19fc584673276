// SPDX-License-Identifier: Apache-2.0
// Proves that our listing of a device and v4l2-ctl's agree, field by field: two programs that read
// the same kernel calls on their own.
#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <memory>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/v4l2/v4l2_devices.hpp>

#include "v4l2_vm/vivid.hpp"

namespace striper::testing {
namespace {

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  std::string text;
  std::array<char, 4096> part{};
  while (pipe && std::fgets(part.data(), part.size(), pipe.get()) != nullptr) text += part.data();
  return text;
}

std::string ctl(const std::string& arguments) {
  return output_of("v4l2-ctl -d " + capture_path() + " " + arguments + " 2>/dev/null");
}

std::vector<std::string> all_matches(const std::string& text, const std::string& pattern) {
  const std::regex expression(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), expression), end; match != end; ++match)
    found.push_back((*match)[1]);
  return found;
}

std::string first_match(const std::string& text, const std::string& pattern) {
  const std::vector<std::string> found = all_matches(text, pattern);
  return found.empty() ? std::string() : found.front();
}

class Listing : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!Node(capture_path()).is_open()) GTEST_SKIP() << "there is no " << capture_path();
    if (output_of("v4l2-ctl --version").empty()) GTEST_SKIP() << "v4l2-ctl is not installed";
    listing_ = describe_v4l2_camera(capture_path());
  }

  CameraListing listing_;
};

TEST_F(Listing, DriverCardAndBusAgree) {
  const std::string info = ctl("--info");
  EXPECT_EQ(listing_.driver, first_match(info, "Driver name +: (.*)\n"));
  EXPECT_EQ(listing_.name, first_match(info, "Card type +: (.*)\n"));
  EXPECT_EQ(listing_.address, first_match(info, "Bus info +: (.*)\n"));
  EXPECT_EQ(listing_.uri, "v4l2:" + capture_path());
}

TEST_F(Listing, InputsAndTheCurrentOneAgree) {
  const std::string inputs = ctl("--list-inputs");
  const auto names = all_matches(inputs, "Name +: (.*)\n");
  ASSERT_EQ(listing_.inputs.size(), names.size());
  const std::string current = first_match(ctl("--get-input"), "Video input +: (\\d+)");
  for (std::size_t at = 0; at < names.size(); ++at) {
    EXPECT_EQ(listing_.inputs[at].name, names[at]);
    EXPECT_EQ(listing_.inputs[at].is_current, std::to_string(at) == current);
  }
}

TEST_F(Listing, StandardsAgree) {
  const auto words = all_matches(ctl("--list-inputs"), "Standard +: 0x[0-9A-Fa-f]+ \\((.*)\\)\n");
  ASSERT_EQ(listing_.inputs.size(), words.size());
  for (std::size_t at = 0; at < words.size(); ++at) {
    const auto& ours = listing_.inputs[at].standards;
    EXPECT_EQ(ours.empty(), words[at].empty());
    const auto has = [&](const char* word) {
      return std::find(ours.begin(), ours.end(), word) != ours.end();
    };
    EXPECT_EQ(has("ntsc-m"), words[at].find("NTSC-M") != std::string::npos);
    EXPECT_EQ(has("pal-60"), words[at].find("60 ") != std::string::npos);
    EXPECT_EQ(has("secam"), words[at].find("SECAM") != std::string::npos);
  }
}

TEST_F(Listing, FormatsSizesAndRatesAgree) {
  for (const char* const input : {"0", "1"}) {
    if (output_of("v4l2-ctl -d " + capture_path() + " -i " + input + " 2>/dev/null").empty())
      continue;
    listing_ = describe_v4l2_camera(capture_path());
    std::vector<std::string> ours;
    for (const CameraFormat& format : listing_.formats) {
      ours.push_back("format " + format.name);
      if (!format.size_range.empty()) ours.push_back("range " + format.size_range);
      for (const CameraSize& size : format.sizes) {
        ours.push_back("size " + std::to_string(size.width) + "x" + std::to_string(size.height));
        for (const double rate : size.rates_hz) {
          std::array<char, 32> text{};
          std::snprintf(text.data(), text.size(), "rate %.3f", rate);
          ours.emplace_back(text.data());
        }
      }
    }
    std::vector<std::string> theirs;
    std::istringstream lines(ctl("--list-formats-ext"));
    for (std::string line; std::getline(lines, line);) {
      std::smatch match;
      if (std::regex_search(line, match, std::regex("\\[\\d+\\]: '(.{4}(-BE)?)'"))) {
        std::string name = match[1];
        name.erase(std::remove(name.begin(), name.end(), ' '), name.end());
        theirs.push_back("format " + name);
      } else if (std::regex_search(line, match, std::regex("Size: Discrete (\\S+)"))) {
        theirs.push_back("size " + std::string(match[1]));
      } else if (std::regex_search(line, match, std::regex("\\(([0-9.]+) fps\\)"))) {
        theirs.push_back("rate " + std::string(match[1]));
      } else if (std::regex_search(
                     line, match, std::regex("Stepwise (\\S+) - (\\S+) with step (\\d+)/(\\d+)"))) {
        theirs.push_back("range " + std::string(match[1]) + " to " + std::string(match[2]) +
                         " in steps of " + std::string(match[3]) + "x" + std::string(match[4]));
      }
    }
    EXPECT_FALSE(theirs.empty());
    EXPECT_EQ(ours, theirs) << "input " << input;
  }
}

TEST_F(Listing, ControlsBoundsAndValuesAgree) {
  std::map<std::string, std::string> theirs;
  std::istringstream lines(ctl("--list-ctrls"));
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (!std::regex_search(line, match,
                           std::regex("^ *(\\w+) 0x[0-9a-f]+ \\((\\w+) *\\) *: ?(.*)")))
      continue;
    if (line.find("has-payload") != std::string::npos || match[2] == "str") continue;
    theirs[match[1]] = match[3];
  }
  EXPECT_EQ(listing_.controls.size(), theirs.size());
  for (const CameraControl& control : listing_.controls) {
    ASSERT_TRUE(theirs.contains(control.name)) << control.name;
    const std::string& text = theirs[control.name];
    const auto expect_number = [&](const char* word, double ours) {
      const std::string number = first_match(text, std::string("\\b") + word + "=(-?\\w+)");
      if (number.empty()) return;
      const double value = number.starts_with("0x")
                               ? static_cast<double>(std::stoul(number, nullptr, 16))
                               : std::stod(number);
      const bool is_bitmask = control.type == "bitmask";
      const double mine =
          is_bitmask ? static_cast<std::uint32_t>(static_cast<std::int64_t>(ours)) : ours;
      const double other =
          is_bitmask ? static_cast<std::uint32_t>(static_cast<std::int64_t>(value)) : value;
      EXPECT_EQ(mine, other) << control.name << " " << word << ": " << text;
    };
    expect_number("min", control.minimum);
    expect_number("max", control.maximum);
    expect_number("step", control.step);
    expect_number("default", control.default_value);
    const bool is_volatile = text.find("volatile") != std::string::npos;
    if (control.value && !is_volatile) expect_number("value", *control.value);
    EXPECT_EQ(control.is_settable, text.find("read-only") == std::string::npos) << control.name;
  }
}

TEST_F(Listing, EveryMenuEntryAgrees) {
  const std::string menus = ctl("--list-ctrls-menus");
  for (const CameraControl& control : listing_.controls) {
    for (const std::string& entry : control.menu) {
      const std::string text = entry.substr(0, entry.find_last_not_of(' ') + 1);
      EXPECT_NE(menus.find(text), std::string::npos) << control.name << ": " << entry;
    }
  }
}

TEST_F(Listing, EveryCaptureNodeIsListedAndNoOutput) {
  const std::vector<CameraListing> all = list_v4l2_cameras();
  const auto has = [&](const std::string& path) {
    return std::any_of(all.begin(), all.end(),
                       [&](const CameraListing& one) { return one.uri == "v4l2:" + path; });
  };
  EXPECT_TRUE(has(capture_path()));
  if (Node(output_path()).is_vivid()) {
    EXPECT_FALSE(has(output_path()));
    EXPECT_TRUE(has("/dev/video2")) << "the multi-planar one";
    EXPECT_THROW(describe_v4l2_camera(output_path()), Error);
  }
}

}  // namespace
}  // namespace striper::testing
