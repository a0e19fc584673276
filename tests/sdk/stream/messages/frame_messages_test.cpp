// SPDX-License-Identifier: Apache-2.0
// Proves: a frame of every kind of pixel goes through its messages and back to the bit; other
// programs' images of either byte order, with gaps between rows, red first, are read; an event
// keeps its time; what stands for nothing is refused.
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/stream/messages/frame_messages.hpp>

#include "support/error_of.hpp"
#include "support/kept_frames.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using striper::testing::error_of;
using ::testing::HasSubstr;

bool are_equal(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), static_cast<std::size_t>(a.cols) * a.elemSize()) != 0)
      return false;
  }
  return true;
}

Frame any_frame(int type) {
  Frame frame;
  // Every other row of a frame: rows that do not follow one another in memory.
  cv::Mat image(14, 9, type);
  for (int row = 0; row < image.rows; ++row) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(image.cols) * image.elemSize(); ++i) {
      image.ptr(row)[i] = static_cast<std::uint8_t>(striper::testing::random_generator()());
    }
  }
  frame.image = cv::Mat(7, 9, type, image.data, 2 * image.step);
  frame.lease = std::make_shared<cv::Mat>(image);
  frame.bit_depth = 12;
  frame.sensor_size = {640, 480};
  frame.grid = {{3.5, 2.0}, {-0.25, 4.0}};
  frame.sequence = 1ULL << 40;
  frame.epoch = 3;
  frame.exposure_in_picture = 1;
  frame.exposures_per_picture = 2;
  frame.time = {123'456'789'012, -5};
  frame.field_period_ns = 16'683'333;
  frame.exposure_ns = 20'000;
  frame.illumination = Illumination::laser(1);
  frame.field = Field::kInterlacedBottomFirst;
  frame.status = FrameStatus::kIncomplete;
  frame.status_detail = "3 packets never came";
  frame.encoder_counts = -77;
  return frame;
}

class FramePixels : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(All, FramePixels, ::testing::Values(CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3));

TEST_P(FramePixels, ComeBackToTheBit) {
  const Frame frame = any_frame(GetParam());
  wire::Image image;
  to_message(frame, "striper_camera_optical", image);
  EXPECT_EQ(image.header.frame_id, "striper_camera_optical");
  EXPECT_EQ(image.data.size(), 7U * 9 * frame.image.elemSize());
  Frame back;
  from_message(image, back);
  EXPECT_TRUE(are_equal(back.image, frame.image));
}

TEST(FrameInfoMessage, ComesBackToTheBit) {
  for (const Illumination& light :
       {Illumination::unknown(), Illumination::dark(), Illumination::laser(0)}) {
    Frame frame = any_frame(CV_8UC1);
    frame.illumination = light;
    if (light.is_dark()) frame.time.utc_offset_ns.reset();
    if (light.is_unknown()) frame.encoder_counts.reset();
    wire::FrameInfo message;
    to_message(frame, IlluminationPattern::parse("0,dark"), message);
    Frame back = any_frame(CV_8UC1);
    IlluminationPattern pattern;
    from_message(message, back, pattern);
    EXPECT_EQ(pattern, IlluminationPattern::parse("0,dark"));
    striper::testing::expect_same_members(back, frame);
  }
}

TEST(FrameInfoMessage, AnUnknownPatternStaysUnknown) {
  wire::FrameInfo message;
  to_message(any_frame(CV_8UC1), IlluminationPattern(), message);
  Frame back;
  IlluminationPattern pattern = IlluminationPattern::parse("0");
  from_message(message, back, pattern);
  EXPECT_TRUE(pattern.is_automatic());
}

TEST(FrameInfoMessage, ThatIsNoneIsRefused) {
  wire::FrameInfo message;
  to_message(any_frame(CV_8UC1), IlluminationPattern(), message);
  const auto refusal = [&](auto change) {
    wire::FrameInfo changed = message;
    change(changed);
    Frame frame;
    IlluminationPattern pattern;
    const Error error = error_of([&] { from_message(changed, frame, pattern); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
    return std::string(error.what());
  };
  EXPECT_EQ(refusal([](auto& m) { m.bit_depth = 17; }),
            "striper_msgs/msg/FrameInfo.bit_depth: 17 where 8 to 16 is expected");
  EXPECT_THAT(refusal([](auto& m) { m.field = 5; }), HasSubstr("field: 5"));
  EXPECT_THAT(refusal([](auto& m) { m.status = 4; }), HasSubstr("status: 4"));
  EXPECT_THAT(refusal([](auto& m) { m.exposure_in_picture = 2; }),
              HasSubstr("exposure_in_picture: 2"));
  EXPECT_THAT(refusal([](auto& m) { m.illumination = -3; }), HasSubstr("illumination: -3"));
  EXPECT_THAT(refusal([](auto& m) { m.cadence = "0,light"; }), HasSubstr("cadence: "));
}

TEST(ImageMessageOfOthers, IsReadWithGapsRedFirstAndOfEitherByteOrder) {
  wire::Image image;
  image.height = 2;
  image.width = 1;
  image.encoding = "rgb16";
  image.is_bigendian = 1;
  image.step = 8;
  image.data = {1, 2, 3, 4, 5, 6, 99, 99, 7, 8, 9, 10, 11, 12, 99, 99};
  Frame frame;
  from_message(image, frame);
  const auto pixel = frame.image.at<cv::Vec3w>(1, 0);
  EXPECT_EQ(pixel, cv::Vec3w(0x0b0c, 0x090a, 0x0708));
}

TEST(ImageMessageOfOthers, ThatCannotBeReadIsRefused) {
  wire::Image image;
  to_message(any_frame(CV_8UC1), "camera", image);
  Frame frame;
  const auto refusal = [&](auto change) {
    wire::Image changed = image;
    change(changed);
    return error_of([&] { from_message(changed, frame); });
  };
  EXPECT_EQ(refusal([](auto& m) { m.encoding = "bayer_rggb8"; }).kind(), ErrorKind::kUnsupported);
  EXPECT_EQ(refusal([](auto& m) { m.data.pop_back(); }).kind(), ErrorKind::kBadFile);
  EXPECT_EQ(refusal([](auto& m) { m.step = 8; }).kind(), ErrorKind::kBadFile);
  EXPECT_EQ(refusal([](auto& m) { m.height = 0; }).kind(), ErrorKind::kBadFile);
  EXPECT_EQ(refusal([](auto& m) { m.height = 0xffffffff; }).kind(), ErrorKind::kBadFile);
  EXPECT_EQ(error_of([&] { to_message(Frame(), "camera", image); }).kind(),
            ErrorKind::kUnsupported);
}

TEST(EventMessage, ComesBackWithItsTime) {
  for (int trial = 0; trial < 1000; ++trial) {
    Event event(Severity::kError, "source_lost", "it is gone", "look for it");
    event.head = "left";
    event.time_s = striper::testing::uniform(1.6e9, 2.1e9);
    wire::Event message;
    to_message(event, message);
    const Event back = event_from_message(message);
    ASSERT_EQ(back.time_s, event.time_s);
    EXPECT_EQ(back.code, event.code);
    EXPECT_EQ(back.severity, event.severity);
    EXPECT_EQ(back.head, event.head);
    EXPECT_EQ(back.message, event.message);
    EXPECT_EQ(back.advice, event.advice);
  }
  wire::Event unknown;
  unknown.code = "of_tomorrow";
  EXPECT_EQ(error_of([&] { event_from_message(unknown); }).kind(), ErrorKind::kBadFile);
}

}  // namespace
}  // namespace striper
