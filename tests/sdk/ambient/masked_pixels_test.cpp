// SPDX-License-Identifier: Apache-2.0
// Proves that the flare of a light source that moves is masked as far as it is as bright as a
// stripe, in the lit exposure and in a dark one, and that of a light source that stands, which is
// subtracted, is not. What saturates, and how far from a light source, is in subtraction_test.cpp.
#include "ambient/pixels/masked_pixels.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "support/random.hpp"

namespace striper {
namespace {

const cv::Size kSize(200, 160);
constexpr double kFlare_dn = 30.0;
constexpr double kFlareSigma_px = 5.0;

// A specular highlight with its flare on a noisy ground.
cv::Mat highlight_at(cv::Point place) {
  cv::Mat image(kSize, CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double r = std::hypot(u - place.x, v - place.y);
      const double flare_dn =
          kFlare_dn * std::exp(-0.5 * r * r / (kFlareSigma_px * kFlareSigma_px));
      const double dn = r < 2.5 ? 1e4 : 60.0 + flare_dn + testing::normal(0.0, 1.5);
      image.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(dn);
    }
  }
  return image;
}

// One dark exposure before.
cv::Mat masked_of(const cv::Mat& lit, const cv::Mat& dark) {
  detail::MaskedPixels spots;
  spots.prepare(kSize);
  for (int row = 0; row < kSize.height; ++row) spots.set_row(row, true, true);
  return spots.find(lit, &dark, nullptr, dark, 255).clone();
}

TEST(MaskedPixels, FlareOfALightSourceThatMovesIsMasked) {
  testing::reseed();
  const cv::Point there(60, 80);
  const cv::Point here(110, 80);
  const cv::Mat masked = masked_of(highlight_at(here), highlight_at(there));
  for (const cv::Point light_source : {here, there}) {
    for (const int reach : {-9, -5, 5, 9}) {  // The flare is 6 DN there and more.
      EXPECT_NE(masked.at<std::uint8_t>(light_source.y, light_source.x + reach), 0) << reach;
      EXPECT_NE(masked.at<std::uint8_t>(light_source.y + reach, light_source.x), 0) << reach;
    }
    for (const int reach : {-21, 21}) {
      EXPECT_EQ(masked.at<std::uint8_t>(light_source.y, light_source.x + reach), 0) << reach;
      EXPECT_EQ(masked.at<std::uint8_t>(light_source.y + reach, light_source.x), 0) << reach;
    }
  }
}

TEST(MaskedPixels, FlareOfALightSourceThatStandsIsTakenOff) {
  testing::reseed();
  const cv::Point light_source(100, 80);
  const cv::Mat masked = masked_of(highlight_at(light_source), highlight_at(light_source));
  EXPECT_NE(masked.at<std::uint8_t>(light_source), 0);
  for (const int reach : {-8, 8}) {
    EXPECT_EQ(masked.at<std::uint8_t>(light_source.y, light_source.x + reach), 0) << reach;
    EXPECT_EQ(masked.at<std::uint8_t>(light_source.y + reach, light_source.x), 0) << reach;
  }
}

}  // namespace
}  // namespace striper
