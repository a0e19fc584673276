// SPDX-License-Identifier: Apache-2.0
// Proves that light that stands still under a peak, in the lit as in the dark exposure, is no
// stripe where the camera's noise is known: its shot noise is that of its brightest pixels, not of
// the surroundings. And that the error of a stripe that lies on it is told right. Motion and edges
// are the ambient stage's.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/robust.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

constexpr NoiseModel kNoise{1.5, 0.3, 4.0, 8};
constexpr int kColumns = 640;
constexpr int kRows = 120;

// A marking, and what the laser adds to it.
struct Scene {
  double marking_dn = 0.0;
  double marking_sigma_px = 1.5;
  double stripe_dn = 0.0;

  double row(int column) const { return 60.4 + 0.5 * std::sin(column / 40.0); }

  cv::Mat expose(bool is_lit) const {
    cv::Mat image(kRows, kColumns, CV_8U);
    for (int v = 0; v < kRows; ++v) {
      for (int u = 0; u < kColumns; ++u) {
        double light = 30.0;
        light += testing::box_gaussian(v, 60.4, marking_sigma_px, marking_dn);
        if (is_lit) light += testing::box_gaussian(v, row(u), 1.5, stripe_dn);
        const double dn = testing::normal(light, std::sqrt(kNoise.variance_dn2(light) - 1.0 / 12));
        image.at<std::uint8_t>(v, u) =
            static_cast<std::uint8_t>(std::clamp(std::round(dn), 0.0, 255.0));
      }
    }
    return image;
  }

  LitFrame frame() const {
    LitFrame frame;
    frame.lit = expose(true);
    frame.dark = expose(false);
    frame.full_scale_dn = 255;
    return frame;
  }
};

ExtractOptions with_noise(ExtractMethod method) {
  ExtractOptions options;
  options.method = method;
  options.noise = kNoise;
  options.stripe_sigma_px = 1.5;
  options.excess_sigma_px = 0.0;
  return options;
}

int good_returns(StripeExtractor& extractor, const LitFrame& frame) {
  Stripe stripe;
  extractor.extract(frame, stripe);
  return static_cast<int>(
      std::count(stripe.status.begin(), stripe.status.end(), ReturnStatus::kOk));
}

TEST(DarkNoise, MarkingThatStandsStillIsNoStripe) {
  constexpr int kFrames = 12;
  for (const double width_px : {1.5, 4.0}) {
    testing::reseed();
    const Scene scene{150.0, width_px, 0.0};
    std::vector<LitFrame> frames;
    frames.reserve(kFrames);
    for (int n = 0; n < kFrames; ++n) frames.push_back(scene.frame());
    for (const ExtractMethod method : {ExtractMethod::kFast, ExtractMethod::kRefined}) {
      for (const PeakRule peak : {PeakRule::kBrightest, PeakRule::kContinuous}) {
        ExtractOptions options = with_noise(method);
        options.peak = peak;
        const auto extractor = make_extractor(options);
        int found = 0;
        for (const LitFrame& frame : frames) found += good_returns(*extractor, frame);
        EXPECT_LE(found, 5e-4 * kFrames * kColumns)
            << static_cast<int>(method) << ' ' << static_cast<int>(peak) << ' ' << width_px;
      }
    }
  }
}

TEST(DarkNoise, StripeOnAMarkingKnowsItsError) {
  for (const ExtractMethod method : {ExtractMethod::kFast, ExtractMethod::kRefined}) {
    testing::reseed();
    const Scene scene{100.0, 1.5, 90.0};
    const auto extractor = make_extractor(with_noise(method));
    Stripe stripe;
    std::vector<double> pulls;
    for (int n = 0; n < 6; ++n) {
      extractor->extract(scene.frame(), stripe);
      for (std::size_t i = 0; i < stripe.size(); ++i) {
        if (stripe.status[i] != ReturnStatus::kOk) continue;
        const double error = stripe.across_px[i] - scene.row(static_cast<int>(i));
        pulls.push_back(std::abs(error) / stripe.sigma_px[i]);
      }
    }
    EXPECT_GT(pulls.size(), 3800U);
    // The whole peak is given the noise of its middle: a little more than it has.
    const double pull = robust_sigma(pulls);
    EXPECT_GT(pull, 0.85) << static_cast<int>(method);
    EXPECT_LT(pull, 1.05) << static_cast<int>(method);
  }
}

}  // namespace
}  // namespace striper
