// SPDX-License-Identifier: Apache-2.0
// Frames that whatever keeps frames has to give again, and how they are compared.
#pragma once

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/frame.hpp>

#include "support/random.hpp"

namespace striper::testing {

inline cv::Mat draw_noise(int type, cv::Size size = {40, 30}) {
  cv::Mat image(size, type);
  for (std::size_t i = 0; i < image.total() * image.elemSize(); ++i) {
    image.data[i] = static_cast<std::uint8_t>(uniform(0.0, 256.0));
  }
  return image;
}

inline Frame plain_frame(std::uint64_t sequence, int type = CV_8UC1) {
  Frame frame;
  frame.image = draw_noise(type);
  frame.bit_depth = CV_MAT_DEPTH(type) == CV_16U ? 16 : 8;
  frame.sensor_size = frame.image.size();
  frame.sequence = sequence;
  frame.time.monotonic_ns = static_cast<std::int64_t>(sequence % 1'000'000) * 33'366'667;
  return frame;
}

/// Every member that is not its default, with a gap, a new epoch and a dark exposure behind it.
inline std::vector<Frame> full_frames() {
  Frame frame = plain_frame(987654321012345, CV_16UC1);
  frame.bit_depth = 12;
  frame.sensor_size = {1280, 1024};
  frame.grid = {{100.5, 2.0}, {1.0 / 3.0, 0.1}};
  frame.time = {123456789012345678, 1700000000000000000};
  frame.exposure_ns = 2500;
  frame.illumination = Illumination::laser(3);
  frame.encoder_counts = -9'000'000'000'000'000'000;
  Frame dark = frame;
  dark.sequence += 5;
  dark.epoch = 2;
  dark.illumination = Illumination::dark();
  dark.time.monotonic_ns += 5;
  return {frame, dark};
}

inline Frame interlaced_frame() {
  Frame interlaced = plain_frame(4);
  interlaced.field = Field::kInterlacedBottomFirst;
  interlaced.exposures_per_picture = 2;
  interlaced.field_period_ns = 16'683'333;
  return interlaced;
}

inline std::vector<Frame> single_fields() {
  Frame top = plain_frame(4);
  top.field = Field::kTop;
  top.exposures_per_picture = 2;
  top.grid = PixelGrid::top_field();
  top.sensor_size = {40, 61};
  Frame bottom = top;
  bottom.field = Field::kBottom;
  bottom.exposure_in_picture = 1;
  bottom.grid = PixelGrid::bottom_field();
  top.image = draw_noise(CV_8UC1, {40, 31});  // An odd frame's top field has a row more.
  return {top, bottom};
}

/// A corrupt frame without an image and an incomplete one, between good ones.
inline std::vector<Frame> bad_frames() {
  Frame corrupt = plain_frame(1);
  corrupt.image.release();
  corrupt.status = FrameStatus::kCorrupt;
  corrupt.status_detail = "buffer 3, \"error\" flag set, 4 bytes short";
  Frame incomplete = plain_frame(2);
  incomplete.status = FrameStatus::kIncomplete;
  incomplete.status_detail = "2 packets lost";
  return {plain_frame(0), corrupt, incomplete, plain_frame(3)};
}

inline bool is_same(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.empty() != b.empty()) return false;
  return a.empty() || (a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0);
}

/// All but the image.
inline void expect_same_members(const Frame& a, const Frame& b) {
  EXPECT_EQ(a.bit_depth, b.bit_depth);
  EXPECT_EQ(a.sensor_size, b.sensor_size);
  EXPECT_EQ(a.grid, b.grid);
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(a.epoch, b.epoch);
  EXPECT_EQ(a.exposure_in_picture, b.exposure_in_picture);
  EXPECT_EQ(a.exposures_per_picture, b.exposures_per_picture);
  EXPECT_EQ(a.time.monotonic_ns, b.time.monotonic_ns);
  EXPECT_EQ(a.time.utc_offset_ns, b.time.utc_offset_ns);
  EXPECT_EQ(a.field_period_ns, b.field_period_ns);
  EXPECT_EQ(a.exposure_ns, b.exposure_ns);
  EXPECT_EQ(a.illumination, b.illumination);
  EXPECT_EQ(a.encoder_counts, b.encoder_counts);
  EXPECT_EQ(a.field, b.field);
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.status_detail, b.status_detail);
}

inline void expect_same_frame(const Frame& a, const Frame& b) {
  EXPECT_TRUE(is_same(a.image, b.image));
  expect_same_members(a, b);
}

}  // namespace striper::testing
