// SPDX-License-Identifier: Apache-2.0
// Proves that a stripe that drifts across an edge between black and white, and clips on the white
// side, is where its error bar says in nearly all scan lines: for several widths and heights, 8 and
// 12 bits. Without the correction hardly any is. What does not clip: reflectance_edge_test.cpp of
// tests/end_to_end, in rendered images.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/stripe/extractor.hpp>

#include "support/edge_light.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

constexpr int kLines = 200;
constexpr int kLength = 160;
constexpr double kEdge = 80.2;
constexpr double kBlack_dn = 5.0;
constexpr double kAmbient_dn = 50.0;
constexpr double kContrast = 0.8;
constexpr double kBlur_px = 0.45;
constexpr NoiseModel kNoise{1.0, 0.02, kBlack_dn};

struct Case {
  std::string name;
  double width_px;
  double amplitude_dn;  // Of 8 bits, where the reflectance is the mean of both sides.
  bool is_12_bit = false;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

double position_of(int line) { return kEdge + 3.0 * (line - 0.5 * kLines) / kLines; }

// The noise of 12 bits is that of 8, in parts of full scale.
LitFrame drifting(const Case& c) {
  const double scale = c.is_12_bit ? 16.0 : 1.0;
  const double laser_sigma = std::sqrt(c.width_px * c.width_px - kBlur_px * kBlur_px);
  const double height = c.amplitude_dn * c.width_px / laser_sigma;
  const auto side = [](double x) { return 1.0 + (x > kEdge ? kContrast : -kContrast); };
  LitFrame frame;
  frame.full_scale_dn = c.is_12_bit ? 4095 : 255;
  cv::Mat dn(kLength, kLines, CV_64F);
  for (int line = 0; line < kLines; ++line) {
    const auto light = [&](double x) {
      const double z = (x - position_of(line)) / laser_sigma;
      return (kAmbient_dn + height * std::exp(-0.5 * z * z)) * side(x);
    };
    for (int k = 0; k < kLength; ++k) {
      const double mean = kBlack_dn + testing::seen_of_edge(light, kEdge, k, kBlur_px);
      const double noisy = mean + testing::normal(0.0, std::sqrt(kNoise.variance_dn2(mean)));
      dn.at<double>(k, line) = std::min(scale * noisy, static_cast<double>(frame.full_scale_dn));
    }
  }
  dn.convertTo(frame.lit, c.is_12_bit ? CV_16U : CV_8U);
  return frame;
}

class AClippedStripeAcrossAnEdge : public ::testing::TestWithParam<Case> {};

TEST_P(AClippedStripeAcrossAnEdge, IsWhereItsErrorBarSays) {
  const Case& c = GetParam();
  ExtractOptions options;
  options.stripe_sigma_px = c.width_px;
  options.each_line_by_itself = true;  // Which thing is the stripe is proven elsewhere.
  options.noise = kNoise;
  if (c.is_12_bit) options.noise = NoiseModel{16.0, 0.32, 16.0 * kBlack_dn};
  Stripe stripe;
  make_extractor(options)->extract(drifting(c), stripe);
  int far_off = 0;
  int half_off = 0;
  int good = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (verdict(stripe.status[i]) == Verdict::kMissing) continue;
    ++good;
    const double off_px = std::abs(stripe.across_px[i] - position_of(stripe.line[i]));
    far_off += off_px > 5.0 * stripe.sigma_px[i] ? 1 : 0;
    half_off += off_px > 0.5 * c.width_px ? 1 : 0;
  }
  std::cout << good << " good, " << far_off << " beyond 5 sigmas, " << half_off
            << " half a width off\n";
  EXPECT_EQ(good, kLines);
  EXPECT_LE(far_off, kLines / 8);
  EXPECT_LE(half_off, kLines * 3 / 20);
}

INSTANTIATE_TEST_SUITE_P(ReflectanceEdges, AClippedStripeAcrossAnEdge,
                         ::testing::Values(Case{"Narrow", 1.2, 600.0},
                                           Case{"NarrowHigh", 1.2, 900.0},
                                           Case{"Usual", 1.6, 900.0}, Case{"Wide", 2.2, 900.0},
                                           Case{"WideHigh", 2.2, 1500.0},
                                           Case{"Bits12", 1.6, 900.0, true}),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace striper
