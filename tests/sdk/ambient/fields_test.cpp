// SPDX-License-Identifier: Apache-2.0
// Proves that an interlaced frame becomes two fields with the right rows, grids, times and order,
// without a copy and without tying the fields' life to the frame's.
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/ambient/fields.hpp>

namespace striper {
namespace {

Frame interlaced(Field order, int rows = 7) {
  Frame frame;
  frame.image = cv::Mat(rows, 5, CV_8UC1);
  for (int v = 0; v < rows; ++v) frame.image.row(v).setTo(10 * v);
  frame.sensor_size = frame.image.size();
  frame.field = order;
  frame.exposures_per_picture = 2;
  frame.sequence = 3;
  frame.time.monotonic_ns = 1000;
  frame.field_period_ns = 500;
  return frame;
}

TEST(SplitFields, TopFirstGivesEvenRowsFirst) {
  const auto [first, second] = split_fields(interlaced(Field::kInterlacedTopFirst));
  EXPECT_EQ(first.field, Field::kTop);
  EXPECT_EQ(second.field, Field::kBottom);
  ASSERT_EQ(first.image.rows, 4);
  ASSERT_EQ(second.image.rows, 3);
  for (int v = 0; v < 4; ++v) EXPECT_EQ(first.image.at<std::uint8_t>(v, 2), 20 * v);
  for (int v = 0; v < 3; ++v) EXPECT_EQ(second.image.at<std::uint8_t>(v, 2), 20 * v + 10);
  EXPECT_EQ(first.grid.sensor_v(2), 4.0);
  EXPECT_EQ(second.grid.sensor_v(2), 5.0);
}

TEST(SplitFields, BottomFirstGivesOddRowsFirst) {
  const auto [first, second] = split_fields(interlaced(Field::kInterlacedBottomFirst));
  EXPECT_EQ(first.field, Field::kBottom);
  EXPECT_EQ(first.image.at<std::uint8_t>(0, 0), 10);
  EXPECT_EQ(first.exposure_number(), 6U);
  EXPECT_EQ(second.exposure_number(), 7U);
  EXPECT_EQ(first.time.monotonic_ns, 1000);
  EXPECT_EQ(second.time.monotonic_ns, 1500);
}

TEST(SplitFields, SharesThePixelsAndOutlivesTheFrame) {
  Frame frame = interlaced(Field::kInterlacedTopFirst);
  const uchar* const pixels = frame.image.data;
  std::array<Frame, 2> fields = split_fields(frame);
  frame = Frame();
  EXPECT_EQ(fields[0].image.data, pixels);
  EXPECT_EQ(fields[1].image.at<std::uint8_t>(2, 4), 50);
  cv::Mat copy = fields[1].image.clone();
  EXPECT_EQ(copy.at<std::uint8_t>(1, 1), 30);
}

TEST(ForEachExposure, GivesTheFrameOrItsFieldsThatHaveRows) {
  const auto fields_of = [](const Frame& frame) {
    std::vector<Field> fields;
    for_each_exposure(frame, [&](const Frame& exposure) { fields.push_back(exposure.field); });
    return fields;
  };
  Frame frame = interlaced(Field::kInterlacedBottomFirst);
  EXPECT_EQ(fields_of(frame), (std::vector{Field::kBottom, Field::kTop}));
  frame.field = Field::kProgressive;
  EXPECT_EQ(fields_of(frame), std::vector{Field::kProgressive});
  EXPECT_EQ(fields_of(interlaced(Field::kInterlacedBottomFirst, 1)), std::vector{Field::kTop});
}

TEST(SplitFields, RegionOfInterestKeepsItsOffset) {
  Frame frame = interlaced(Field::kInterlacedTopFirst);
  frame.grid = PixelGrid::region(100, 40);
  const auto [top, bottom] = split_fields(frame);
  EXPECT_EQ(bottom.grid.sensor_v(1), 43.0);
  EXPECT_EQ(bottom.grid.sensor_u(1), 101.0);
}

}  // namespace
}  // namespace striper
