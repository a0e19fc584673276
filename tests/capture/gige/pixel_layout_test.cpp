// SPDX-License-Identifier: Apache-2.0
// Proves that every packing is undone exactly, against the bit positions that the standards draw
// (GigE Vision 1.2 for "Packed", PFNC 2.4 for "p") and by packing and unpacking at every width.
// Does not prove that OpenCV's conversion of a colour mosaic to grey is a good one.
#include "gige/pictures/pixel_layout.hpp"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "support/random.hpp"

namespace striper::detail {
namespace {

cv::Mat random_image(const PixelLayout& layout, cv::Size size) {
  cv::Mat image(size, layout.mat_type());
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const int value = static_cast<int>(testing::uniform(0.0, 1 << layout.bit_depth));
      if (layout.bit_depth == 8) {
        image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(value);
      } else {
        image.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(value);
      }
    }
  }
  return image;
}

TEST(PixelLayout, UnpackUndoesPackForEveryGreyFormatAndWidth) {
  for (const PixelLayout& layout : known_layouts()) {
    if (layout.mosaic != Mosaic::kNone || layout.channels() != 1) continue;
    for (int width = 4; width <= 36; width += 4) {
      const cv::Mat image = random_image(layout, {width, 3});
      std::vector<std::uint8_t> bytes(3 * layout.row_bytes(width));
      pack(layout, image, bytes.data());
      cv::Mat scratch;
      cv::Mat result;
      unpack(layout, image.size(), bytes.data(), scratch, result);
      EXPECT_EQ(cv::norm(image, result, cv::NORM_INF), 0.0) << layout.name << " " << width;
    }
  }
}

TEST(PixelLayout, BitsAreWhereTheStandardsDrawThem) {
  const auto unpacked = [](const char* name, std::vector<std::uint8_t> bytes, int width) {
    cv::Mat scratch;
    cv::Mat result;
    unpack(*find_layout(name), {width, 1}, bytes.data(), scratch, result);
    return std::vector<int>(result.begin<std::uint16_t>(), result.end<std::uint16_t>());
  };
  EXPECT_EQ(unpacked("Mono12Packed", {0xAB, 0x3C, 0x12}, 2), (std::vector{0xABC, 0x123}));
  EXPECT_EQ(unpacked("Mono10Packed", {0xFF, 0x21, 0x80}, 2), (std::vector{0x3FD, 0x202}));
  EXPECT_EQ(unpacked("Mono12p", {0xBC, 0x3A, 0x12}, 2), (std::vector{0xABC, 0x123}));
  EXPECT_EQ(unpacked("Mono10p", {0xFF, 0x03, 0x00, 0xC0, 0xFF}, 4),
            (std::vector{0x3FF, 0x000, 0x000, 0x3FF}));
}

TEST(PixelLayout, DirectFormatsAreNotCopied) {
  std::vector<std::uint8_t> memory(64);
  const cv::Mat image = wrap(*find_layout("Mono12"), {8, 4}, memory.data());
  EXPECT_EQ(image.data, memory.data());
  EXPECT_EQ(image.type(), CV_16UC1);
  EXPECT_TRUE(find_layout("Mono8")->is_direct());
  EXPECT_FALSE(find_layout("Mono12Packed")->is_direct());
}

TEST(PixelLayout, AMosaicOfGreyLightIsGrey) {
  for (const char* name : {"BayerRG8", "BayerGR8", "BayerGB8", "BayerBG8", "BayerRG12p"}) {
    const PixelLayout& layout = *find_layout(name);
    const PixelLayout& grey = *find_layout(layout.bit_depth == 8 ? "Mono8" : "Mono12p");
    const cv::Mat image(8, 8, grey.mat_type(), cv::Scalar(100));
    std::vector<std::uint8_t> bytes(8 * grey.row_bytes(8));
    pack(grey, image, bytes.data());
    cv::Mat scratch;
    cv::Mat result;
    unpack(layout, image.size(), bytes.data(), scratch, result);
    EXPECT_EQ(result.type(), image.type()) << name;
    EXPECT_EQ(cv::norm(image, result, cv::NORM_INF), 0.0) << name;
  }
}

TEST(PixelLayout, RedOfAMosaicCountsAsRed) {
  // One red pixel of every 2 x 2 is lit: grey is 0.299 of it, wherever the red pixel sits.
  const auto mean_grey = [](const char* name, cv::Point red) {
    cv::Mat mosaic(16, 16, CV_8UC1, cv::Scalar(0));
    for (int v = red.y; v < 16; v += 2) {
      for (int u = red.x; u < 16; u += 2) mosaic.at<std::uint8_t>(v, u) = 200;
    }
    cv::Mat scratch;
    cv::Mat result;
    unpack(*find_layout(name), mosaic.size(), mosaic.data, scratch, result);
    return cv::mean(result(cv::Rect(4, 4, 8, 8)))[0];
  };
  EXPECT_NEAR(mean_grey("BayerRG8", {0, 0}), 0.299 * 200, 1.5);
  EXPECT_NEAR(mean_grey("BayerGR8", {1, 0}), 0.299 * 200, 1.5);
  EXPECT_NEAR(mean_grey("BayerGB8", {0, 1}), 0.299 * 200, 1.5);
  EXPECT_NEAR(mean_grey("BayerBG8", {1, 1}), 0.299 * 200, 1.5);
}

TEST(PixelLayout, KnowsFormatsByNameAndByCode) {
  for (const PixelLayout& layout : known_layouts()) {
    EXPECT_EQ(find_layout(layout.name), &layout);
    EXPECT_EQ(find_layout(layout.code), &layout);
  }
  EXPECT_EQ(find_layout("Mono9"), nullptr);
  EXPECT_EQ(find_layout(0u), nullptr);
}

}  // namespace
}  // namespace striper::detail
