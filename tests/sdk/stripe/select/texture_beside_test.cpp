// SPDX-License-Identifier: Apache-2.0
// Proves that the texture beside a candidate is measured where the candidate's own light is not, in
// 8 and 16 bits, along both axes and at the borders of an image.
#include "stripe/select/texture_beside.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core/mat.hpp>

#include "support/random.hpp"

namespace striper::detail {
namespace {

constexpr int kLength = 200;
constexpr double kLevel_dn = 100.0;

constexpr float kWidth_px = 1.5F;

// One scan line, a stripe of that height on it.
template <typename Pixel, typename Background>
LitFrame line_of(float across, double height_dn, const Background& background) {
  cv::Mat_<Pixel> image(kLength, 1);
  for (int k = 0; k < kLength; ++k) {
    const double from = (k - static_cast<double>(across)) / 1.5;
    const double stripe = height_dn * std::exp(-0.5 * from * from);
    image(k, 0) = cv::saturate_cast<Pixel>(background(k) + stripe);
  }
  LitFrame frame;
  frame.lit = image;
  return frame;
}

float texture_of(const LitFrame& frame, float across) {
  return texture_beside(frame, StripeAxis::kColumns, 0, across, kWidth_px);
}

// Its own foot, three widths off, is a hundredth of it.
TEST(TextureBeside, AStripeAloneHasHardlyAny) {
  const auto even = [](int) { return kLevel_dn; };
  EXPECT_LT(texture_of(line_of<std::uint8_t>(100.3F, 120.0, even), 100.3F), 0.002F * 120.0F);
  EXPECT_LT(texture_of(line_of<std::uint16_t>(100.3F, 9000.0, even), 100.3F), 0.002F * 9000.0F);
}

TEST(TextureBeside, ASlopeIsNone) {
  const auto slope = [](int k) { return 20.0 + k; };
  EXPECT_LT(texture_of(line_of<std::uint8_t>(100.0F, 30.0, slope), 100.0F), 0.01F);
}

// Its pixel over the mean of two others: 1.5 times the variance.
TEST(TextureBeside, OfNoiseIsTheNoise) {
  testing::reseed();
  double squares = 0.0;
  constexpr int kLines = 400;
  for (int n = 0; n < kLines; ++n) {
    std::vector<double> noise(kLength);
    for (double& value : noise) value = testing::normal(0.0, 100.0);
    const auto noisy = [&](int k) { return 5000.0 + noise[static_cast<std::size_t>(k)]; };
    const float texture = texture_of(line_of<std::uint16_t>(100.4F, 20000.0, noisy), 100.4F);
    squares += static_cast<double>(texture * texture);
  }
  EXPECT_NEAR(std::sqrt(squares / kLines) / 100.0, std::sqrt(1.5), 0.06);
}

TEST(TextureBeside, IsThatOfTheScanLineAlongEitherAxis) {
  const auto wavy = [](int k) { return kLevel_dn + (k % 6 < 3 ? 30.0 : -30.0); };
  const LitFrame frame = line_of<std::uint8_t>(100.0F, 60.0, wavy);
  LitFrame turned = frame;
  turned.lit = frame.lit.t();
  const float texture = texture_of(frame, 100.0F);
  EXPECT_GT(texture, 20.0F);
  EXPECT_EQ(texture_beside(turned, StripeAxis::kRows, 0, 100.0F, kWidth_px), texture);
}

TEST(TextureBeside, AtABorderIsThatOfTheOtherSide) {
  const auto one_sided = [](int k) { return k < 100 ? kLevel_dn : kLevel_dn + 40.0 * (k % 2); };
  EXPECT_EQ(texture_of(line_of<std::uint8_t>(1.0F, 60.0, one_sided), 1.0F), 0.0F);
  EXPECT_GT(texture_of(line_of<std::uint8_t>(198.0F, 60.0, one_sided), 198.0F), 10.0F);
}

TEST(TextureBeside, WhereNoPixelIsFarEnoughIsNone) {
  LitFrame frame = line_of<std::uint8_t>(8.0F, 60.0, [](int k) { return 50.0 * (k % 2); });
  frame.lit = frame.lit.rowRange(0, 12);
  EXPECT_EQ(texture_of(frame, 6.0F), 0.0F);
}

}  // namespace
}  // namespace striper::detail
