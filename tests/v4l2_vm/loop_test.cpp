// SPDX-License-Identifier: Apache-2.0
// Proves against the kernel's own driver that what was sent arrives bit for bit, in the fields,
// order and format that were sent. Random images, so that nothing can be mistaken for anything
// else.
#include <chrono>
#include <cstring>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/v4l2/v4l2_source.hpp>

#include "support/random.hpp"
#include "v4l2/format/pixel_format.hpp"
#include "v4l2_vm/vivid.hpp"

namespace striper::testing {
namespace {

using std::chrono::milliseconds;

constexpr int kImages = 6;
constexpr int kFrames = 12;

struct Link {
  std::string name;
  std::string uri_query;
  Broadcast broadcast;
  Field first_field = Field::kBottom;  ///< Exposed first.
};

void PrintTo(const Link& link, std::ostream* out) { *out << link.name; }

Broadcast broadcast(v4l2_std_id standard, std::uint32_t code, std::uint32_t field) {
  Broadcast result;
  result.standard = standard;
  result.code = code;
  result.field = field;
  result.height = (standard & V4L2_STD_525_60) != 0 ? 480 : 576;
  return result;
}

std::vector<Link> links() {
  const auto ntsc = [](std::uint32_t code, std::uint32_t field) {
    return broadcast(V4L2_STD_NTSC_M, code, field);
  };
  const auto pal = [](std::uint32_t field) {
    return broadcast(V4L2_STD_PAL_BG, V4L2_PIX_FMT_GREY, field);
  };
  constexpr std::uint32_t kGrey = V4L2_PIX_FMT_GREY;
  return {
      {"ntsc_interlaced", "standard=ntsc-m&format=GREY", ntsc(kGrey, V4L2_FIELD_INTERLACED)},
      {"ntsc_interlaced_tb", "standard=ntsc-m&format=GREY&field=interlaced-tb",
       ntsc(kGrey, V4L2_FIELD_INTERLACED_TB), Field::kTop},
      {"ntsc_interlaced_bt", "standard=ntsc-m&format=GREY&field=interlaced-bt",
       ntsc(kGrey, V4L2_FIELD_INTERLACED_BT)},
      {"ntsc_alternate", "standard=ntsc-m&format=GREY&field=alternate",
       ntsc(kGrey, V4L2_FIELD_ALTERNATE)},
      {"pal_interlaced", "standard=pal&format=GREY", pal(V4L2_FIELD_INTERLACED), Field::kTop},
      {"pal_alternate", "standard=pal&format=GREY&field=alternate", pal(V4L2_FIELD_ALTERNATE),
       Field::kTop},
      {"yuyv", "standard=ntsc-m&format=YUYV", ntsc(V4L2_PIX_FMT_YUYV, V4L2_FIELD_INTERLACED)},
      {"y16", "standard=ntsc-m&format=Y16", ntsc(V4L2_PIX_FMT_Y16, V4L2_FIELD_INTERLACED)},
      {"y10", "standard=ntsc-m&format=Y10", ntsc(V4L2_PIX_FMT_Y10, V4L2_FIELD_INTERLACED)},
      {"rgb", "standard=ntsc-m&format=RGB3", ntsc(V4L2_PIX_FMT_RGB24, V4L2_FIELD_INTERLACED)},
  };
}

// Random bytes; of deep grey only the significant bits, as a camera would give.
std::vector<std::uint8_t> random_buffer(const Broadcast& sent, int rows) {
  const detail::v4l2::PixelFormat& format = *detail::v4l2::find_pixel_format(sent.code);
  std::vector<std::uint8_t> buffer(format.row_bytes(sent.width) * static_cast<std::size_t>(rows));
  for (std::uint8_t& byte : buffer) byte = static_cast<std::uint8_t>(random_generator()() >> 56);
  if (format.has_wide_pixels()) {
    for (std::size_t at = 1; at < buffer.size(); at += 2)
      buffer[at] = static_cast<std::uint8_t>(buffer[at] >> (16 - format.bit_depth));
  }
  return buffer;
}

class VividLoop : public ::testing::TestWithParam<Link> {
 protected:
  void SetUp() override {
    if (!Node(output_path()).is_vivid())
      GTEST_SKIP() << "only the kernel's virtual driver has an output looped to its input";
  }
};

// What the frames of one sent buffer should look like: one image, or one per field.
std::vector<cv::Mat> expected_images(const Broadcast& sent,
                                     const std::vector<std::uint8_t>& buffer) {
  const detail::v4l2::PixelFormat& format = *detail::v4l2::find_pixel_format(sent.code);
  const std::size_t stride = format.row_bytes(sent.width);
  const int parts = V4L2_FIELD_IS_SEQUENTIAL(sent.field) ? 2 : 1;
  const int rows = static_cast<int>(buffer.size() / stride) / parts;
  std::vector<cv::Mat> images(static_cast<std::size_t>(parts));
  for (int part = 0; part < parts; ++part) {
    const std::size_t skip = stride * static_cast<std::size_t>(rows * part);
    detail::v4l2::convert(format,
                          {buffer.data() + skip, buffer.size() - skip, stride, sent.width, rows},
                          images[static_cast<std::size_t>(part)]);
  }
  return images;
}

bool is_same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

TEST_P(VividLoop, WhatWasSentArrivesBitForBitInItsFieldAndOrder) {
  const Broadcast& sent = GetParam().broadcast;
  const bool is_alternate = sent.field == V4L2_FIELD_ALTERNATE;
  std::vector<std::vector<std::uint8_t>> buffers;
  std::vector<std::vector<cv::Mat>> expected;
  for (int number = 0; number < kImages; ++number) {
    buffers.push_back(random_buffer(sent, is_alternate ? sent.height / 2 : sent.height));
    expected.push_back(expected_images(sent, buffers.back()));
  }
  const auto source = open_v4l2(V4l2Options::from_uri(
      SourceUri::parse("v4l2:" + capture_path() + "?input=0&" + GetParam().uri_query)));
  const Transmitter transmitter(output_path(), sent, buffers);
  source->start();

  int arrived = 0;
  int asked = 0;
  for (; arrived < kFrames && asked < 10 * kFrames; ++asked) {
    Frame frame;
    ASSERT_EQ(source->next(frame, milliseconds(3000)), NextStatus::kFrame);
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    for (std::size_t number = 0; number < expected.size(); ++number) {
      const std::vector<cv::Mat>& images = expected[number];
      const auto part =
          static_cast<std::size_t>(images.size() == 2 ? frame.exposure_in_picture : 0);
      if (!is_same(frame.image, images[part])) continue;
      ++arrived;
      if (frame.field == Field::kTop || frame.field == Field::kBottom) {
        const bool is_first = (frame.field == GetParam().first_field);
        EXPECT_EQ(frame.exposure_in_picture, is_first ? 0 : 1);
        if (is_alternate) {
          EXPECT_EQ(number % 2, is_first ? 0U : 1U) << "parity";
        }
      } else {
        EXPECT_EQ(frame.field, GetParam().first_field == Field::kTop
                                   ? Field::kInterlacedTopFirst
                                   : Field::kInterlacedBottomFirst);
      }
      break;
    }
  }
  EXPECT_EQ(arrived, kFrames);
  // Until the first sent image arrives the driver gives its test pattern; after that nothing
  // else.
  EXPECT_LE(asked - arrived, 4) << "frames that are none of the sent images";
}

// The driver's own image, taken once: a colour bar that stands still, without text.
std::vector<Frame> test_pattern(const std::string& query, int frames) {
  const Node node(capture_path());
  int input = 0;
  node.call(VIDIOC_S_INPUT, &input);
  node.set(VividControl::kLoopVideo, 0);
  node.set(VividControl::kOsdText, 2);
  constexpr int kGreyRamp = 20;
  node.set(VividControl::kPattern, kGreyRamp);
  const auto source = open_v4l2(V4l2Options::from_uri(SourceUri::parse(
      "v4l2:" + capture_path() + "?input=0&standard=ntsc-m&format=GREY&" + query)));
  source->start();
  std::vector<Frame> taken(static_cast<std::size_t>(frames));
  for (Frame& frame : taken) EXPECT_EQ(source->next(frame, milliseconds(3000)), NextStatus::kFrame);
  return taken;
}

TEST(VividPattern, SequentialFieldsAreTheRowsOfTheInterlacedImage) {
  if (!Node(output_path()).is_vivid()) GTEST_SKIP() << "only the virtual driver has a known image";
  const cv::Mat interlaced = test_pattern("field=interlaced", 1)[0].image.clone();
  for (const char* const order : {"seq-tb", "seq-bt"}) {
    for (const Frame& field : test_pattern(std::string("field=") + order, 4)) {
      const bool is_first = field.exposure_in_picture == 0;
      EXPECT_EQ(field.field == Field::kTop, is_first == (order == std::string("seq-tb")));
      ASSERT_EQ(field.image.rows * 2, interlaced.rows);
      for (int line = 0; line < field.image.rows; ++line) {
        const int row = static_cast<int>(field.grid.sensor_v(line));
        ASSERT_EQ(cv::norm(field.image.row(line), interlaced.row(row), cv::NORM_INF), 0.0) << row;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sent, VividLoop, ::testing::ValuesIn(links()),
                         [](const auto& link) { return link.param.name; });

}  // namespace
}  // namespace striper::testing
