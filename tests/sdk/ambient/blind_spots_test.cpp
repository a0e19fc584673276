// SPDX-License-Identifier: Apache-2.0
// Proves that the halo of a lamp that moves is blind as far as it is as bright as a stripe, in the
// lit exposure and in a dark one, and that of a lamp that stands, which is taken off, is not. What
// saturates, and how far from a lamp, is in subtraction_test.cpp.
#include "ambient/pixels/blind_spots.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "support/random.hpp"

namespace striper {
namespace {

const cv::Size kSize(200, 160);
constexpr double kHalo_dn = 30.0;
constexpr double kHaloSigma_px = 5.0;

// A glint with its halo on a noisy ground.
cv::Mat glint_at(cv::Point place) {
  cv::Mat image(kSize, CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double r = std::hypot(u - place.x, v - place.y);
      const double halo_dn = kHalo_dn * std::exp(-0.5 * r * r / (kHaloSigma_px * kHaloSigma_px));
      const double dn = r < 2.5 ? 1e4 : 60.0 + halo_dn + testing::normal(0.0, 1.5);
      image.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(dn);
    }
  }
  return image;
}

// One dark exposure before.
cv::Mat blind_of(const cv::Mat& lit, const cv::Mat& dark) {
  detail::BlindSpots spots;
  spots.prepare(kSize);
  for (int row = 0; row < kSize.height; ++row) spots.set_row(row, true, true);
  return spots.find(lit, &dark, nullptr, dark, 255).clone();
}

TEST(BlindSpots, HaloOfALampThatMovesIsBlind) {
  testing::reseed();
  const cv::Point there(60, 80);
  const cv::Point here(110, 80);
  const cv::Mat blind = blind_of(glint_at(here), glint_at(there));
  for (const cv::Point lamp : {here, there}) {
    for (const int reach : {-9, -5, 5, 9}) {  // The halo is 6 DN there and more.
      EXPECT_NE(blind.at<std::uint8_t>(lamp.y, lamp.x + reach), 0) << reach;
      EXPECT_NE(blind.at<std::uint8_t>(lamp.y + reach, lamp.x), 0) << reach;
    }
    for (const int reach : {-21, 21}) {
      EXPECT_EQ(blind.at<std::uint8_t>(lamp.y, lamp.x + reach), 0) << reach;
      EXPECT_EQ(blind.at<std::uint8_t>(lamp.y + reach, lamp.x), 0) << reach;
    }
  }
}

TEST(BlindSpots, HaloOfALampThatStandsIsTakenOff) {
  testing::reseed();
  const cv::Point lamp(100, 80);
  const cv::Mat blind = blind_of(glint_at(lamp), glint_at(lamp));
  EXPECT_NE(blind.at<std::uint8_t>(lamp), 0);
  for (const int reach : {-8, 8}) {
    EXPECT_EQ(blind.at<std::uint8_t>(lamp.y, lamp.x + reach), 0) << reach;
    EXPECT_EQ(blind.at<std::uint8_t>(lamp.y + reach, lamp.x), 0) << reach;
  }
}

}  // namespace
}  // namespace striper
