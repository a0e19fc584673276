// SPDX-License-Identifier: Apache-2.0
// Proves that every pixel format unpacks to the grey (or colour) that was packed, row padding left
// out, and which formats need no copy. Mosaics are only proven on flat images: how they are
// interpolated is OpenCV's.
#include "v4l2/format/pixel_format.hpp"

#include <cstring>
#include <functional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <opencv2/imgcodecs.hpp>

#include "support/random.hpp"

namespace striper::detail::v4l2 {
namespace {

constexpr int kWidth = 12;  // A multiple of every packing's group.
constexpr int kHeight = 5;
constexpr std::size_t kPadding = 4;

using Pack = std::function<void(const std::vector<int>& row, std::uint8_t* to)>;

struct Packed {
  std::uint32_t fourcc;
  Pack pack;
};

void each(const std::vector<int>& row, const std::function<void(int index, int value)>& body) {
  for (int index = 0; index < static_cast<int>(row.size()); ++index)
    body(index, row[static_cast<std::size_t>(index)]);
}

std::uint8_t byte(int value) { return static_cast<std::uint8_t>(value & 0xFF); }

std::vector<Packed> packings() {
  const Pack grey8 = [](const auto& row, auto* to) {
    each(row, [&](int i, int v) { to[i] = byte(v); });
  };
  const Pack little = [](const auto& row, auto* to) {
    each(row, [&](int i, int v) { to[2 * i] = byte(v), to[2 * i + 1] = byte(v >> 8); });
  };
  const Pack big = [](const auto& row, auto* to) {
    each(row, [&](int i, int v) { to[2 * i + 1] = byte(v), to[2 * i] = byte(v >> 8); });
  };
  const Pack first = [](const auto& row, auto* to) {
    each(row, [&](int i, int v) { to[2 * i] = byte(v), to[2 * i + 1] = 77; });
  };
  const Pack second = [](const auto& row, auto* to) {
    each(row, [&](int i, int v) { to[2 * i + 1] = byte(v), to[2 * i] = 77; });
  };
  const Pack mipi10 = [](const auto& row, auto* to) {
    each(row, [&](int i, int v) {
      to[5 * (i / 4) + i % 4] = byte(v >> 2);
      to[5 * (i / 4) + 4] |= byte((v & 3) << (2 * (i % 4)));
    });
  };
  const Pack mipi12 = [](const auto& row, auto* to) {
    each(row, [&](int i, int v) {
      to[3 * (i / 2) + i % 2] = byte(v >> 4);
      to[3 * (i / 2) + 2] |= byte((v & 15) << (4 * (i % 2)));
    });
  };
  const Pack bits10 = [](const auto& row, auto* to) {
    each(row, [&](int i, int v) {
      for (int bit = 0; bit < 10; ++bit) {
        const int at = 10 * i + bit;
        if ((v >> (9 - bit) & 1) != 0) to[at / 8] |= byte(0x80 >> (at % 8));
      }
    });
  };
  return {{V4L2_PIX_FMT_GREY, grey8},     {V4L2_PIX_FMT_NV12, grey8},
          {V4L2_PIX_FMT_Y10, little},     {V4L2_PIX_FMT_Y12, little},
          {V4L2_PIX_FMT_Y16, little},     {V4L2_PIX_FMT_Y16_BE, big},
          {V4L2_PIX_FMT_YUYV, first},     {V4L2_PIX_FMT_UYVY, second},
          {V4L2_PIX_FMT_Y10P, mipi10},    {v4l2_fourcc('Y', '1', '2', 'P'), mipi12},
          {V4L2_PIX_FMT_Y10BPACK, bits10}};
}

TEST(PixelFormat, GreyUnpacksToWhatWasPacked) {
  for (const Packed& packed : packings()) {
    const PixelFormat* const format = find_pixel_format(packed.fourcc);
    ASSERT_NE(format, nullptr) << fourcc_to_string(packed.fourcc);
    const std::size_t stride = format->row_bytes(kWidth) + kPadding;
    std::vector<std::uint8_t> memory(stride * kHeight, 0);
    cv::Mat truth(kHeight, kWidth, CV_32SC1);
    for (int row = 0; row < kHeight; ++row) {
      std::vector<int> values;
      for (int column = 0; column < kWidth; ++column) {
        const int full_scale = (1 << format->bit_depth) - 1;
        values.push_back(static_cast<int>(testing::uniform(0, full_scale + 1)));
        truth.at<int>(row, column) = values.back();
      }
      packed.pack(values, memory.data() + stride * static_cast<std::size_t>(row));
    }
    cv::Mat image;
    const RawImage raw{memory.data(), memory.size(), stride, kWidth, kHeight};
    ASSERT_TRUE(convert(*format, raw, image)) << fourcc_to_string(packed.fourcc);
    EXPECT_EQ(image.type(), format->mat_type());
    cv::Mat as_int;
    image.convertTo(as_int, CV_32S);
    EXPECT_EQ(cv::norm(as_int, truth, cv::NORM_INF), 0.0) << fourcc_to_string(packed.fourcc);
    if (format->is_usable_in_place()) {
      EXPECT_EQ(cv::norm(view(*format, raw), image, cv::NORM_INF), 0.0);
    }
  }
}

TEST(PixelFormat, ColourComesInOpenCvsOrder) {
  struct Order {
    std::uint32_t fourcc;
    std::vector<std::uint8_t> pixel;
  };
  const std::vector<Order> orders{{V4L2_PIX_FMT_BGR24, {10, 20, 30}},
                                  {V4L2_PIX_FMT_RGB24, {30, 20, 10}},
                                  {V4L2_PIX_FMT_XBGR32, {10, 20, 30, 99}},
                                  {V4L2_PIX_FMT_XRGB32, {99, 30, 20, 10}}};
  for (const Order& order : orders) {
    const PixelFormat& format = *find_pixel_format(order.fourcc);
    cv::Mat image;
    ASSERT_TRUE(
        convert(format, {order.pixel.data(), order.pixel.size(), order.pixel.size(), 1, 1}, image));
    EXPECT_EQ(image.at<cv::Vec3b>(0, 0), cv::Vec3b(10, 20, 30)) << fourcc_to_string(order.fourcc);
  }
}

TEST(PixelFormat, FlatMosaicBecomesFlatGrey) {
  for (const PixelFormat& format : pixel_formats()) {
    if (format.bayer_code < 0) continue;
    const std::size_t stride = format.row_bytes(kWidth);
    std::vector<std::uint8_t> memory(stride * 6);
    for (std::size_t at = 0; at < memory.size(); ++at)
      memory[at] = format.bit_depth == 8 ? 90 : byte(at % 2 == 0 ? 0x34 : 0x02);
    cv::Mat image;
    ASSERT_TRUE(convert(format, {memory.data(), memory.size(), stride, kWidth, 6}, image));
    const int expected = format.bit_depth == 8 ? 90 : 0x234;
    EXPECT_EQ(cv::countNonZero(image != expected), 0) << fourcc_to_string(format.fourcc);
  }
}

TEST(PixelFormat, JpegDecodesAndATruncatedOneIsRefused) {
  cv::Mat truth(32, 48, CV_8UC3, cv::Scalar(40, 120, 200));
  std::vector<std::uint8_t> jpeg;
  ASSERT_TRUE(cv::imencode(".jpg", truth, jpeg));
  const PixelFormat& format = *find_pixel_format(V4L2_PIX_FMT_MJPEG);
  cv::Mat image;
  ASSERT_TRUE(convert(format, {jpeg.data(), jpeg.size(), 0, 48, 32}, image));
  EXPECT_LE(cv::norm(image, truth, cv::NORM_INF), 3.0);
  EXPECT_FALSE(convert(format, {jpeg.data(), jpeg.size() / 2, 0, 48, 32}, image));
  EXPECT_FALSE(convert(format, {jpeg.data(), jpeg.size(), 0, 64, 32}, image)) << "of another size";
}

TEST(PixelFormat, ImageThatFitsKeepsItsMemory) {
  const std::vector<std::uint8_t> memory(2 * kWidth * kHeight, 5);
  const PixelFormat& format = *find_pixel_format(V4L2_PIX_FMT_YUYV);
  cv::Mat image(kHeight, kWidth, CV_8UC1);
  const std::uint8_t* const before = image.data;
  convert(format, {memory.data(), memory.size(), 2 * kWidth, kWidth, kHeight}, image);
  EXPECT_EQ(image.data, before);
}

TEST(PixelFormat, CodeAndTextAreInverse) {
  for (const PixelFormat& format : pixel_formats())
    EXPECT_EQ(fourcc_from_string(fourcc_to_string(format.fourcc)), format.fourcc);
  EXPECT_EQ(fourcc_from_string("yuyv"), V4L2_PIX_FMT_YUYV);
  EXPECT_EQ(fourcc_from_string("y16"), V4L2_PIX_FMT_Y16);
  EXPECT_EQ(fourcc_from_string("GREYSCALE"), 0U);
}

TEST(PixelFormat, EightBitGreyIsTheFirstChoiceAndCompressionTheLast) {
  EXPECT_EQ(pixel_formats().front().fourcc, V4L2_PIX_FMT_GREY);
  EXPECT_EQ(pixel_formats().back().layout, Layout::kJpeg);
}

}  // namespace
}  // namespace striper::detail::v4l2
