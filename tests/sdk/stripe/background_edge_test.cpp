// SPDX-License-Identifier: Apache-2.0
// Proves what becomes of the background's edges where no dark exposure is subtracted: none is
// reported as a stripe, whatever the rule and however sharp it is, none teaches the stripe's width,
// and stripes are found about them, fainter ones too where they are not right beside. And that a
// brighter stripe beside a fainter one is no edge.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/stripe/extractor.hpp>

#include "support/random.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

using testing::SyntheticStripe;

constexpr int kEdge = 150;
constexpr double kSharp = 1e-3;

// Noise of 1 DN, so that every height is in sigmas of it.
SyntheticStripe stripe_of(double amplitude_dn, int lines) {
  SyntheticStripe s;
  s.lines = lines;
  s.length = 300;
  s.sigma_px = 1.4;
  s.amplitude_dn = amplitude_dn;
  s.background_dn = 80.0;
  s.noise_dn = 1.0;
  s.bit_depth = 12;
  return s;
}

// A wall beside a darker one, `brighter_dn` below row kEdge, blurred by a Gaussian.
LitFrame with_edge(const SyntheticStripe& s, double brighter_dn, double blur_px) {
  LitFrame frame = testing::render(s);
  for (int v = 0; v < frame.lit.rows; ++v) {
    const double part = 0.5 * (1.0 + std::erf((v - kEdge + 0.5) / (blur_px * std::sqrt(2.0))));
    for (int u = 0; u < frame.lit.cols; ++u) {
      // Rounded by chance, which keeps the noise as it is.
      const double light = brighter_dn * part + testing::uniform(0.0, 1.0);
      auto& pixel = frame.lit.at<std::uint16_t>(v, u);
      pixel = static_cast<std::uint16_t>(pixel + std::floor(light));
    }
  }
  return frame;
}

Stripe extract(const LitFrame& frame, const ExtractOptions& options, int frames = 1) {
  const std::unique_ptr<StripeExtractor> extractor = make_extractor(options);
  Stripe stripe;
  for (int n = 0; n < frames; ++n) extractor->extract(frame, stripe);
  return stripe;
}

int count_good(const Stripe& stripe) {
  return static_cast<int>(
      std::count(stripe.status.begin(), stripe.status.end(), ReturnStatus::kOk));
}

// Returns within 1.5 px of where the stripe is, the good ones or whatever they are called.
int count_right(const Stripe& stripe, const SyntheticStripe& truth, bool only_good = true) {
  int right = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (only_good && stripe.status[i] != ReturnStatus::kOk) continue;
    right += std::abs(stripe.across_px[i] - truth.position(stripe.line[i])) < 1.5 ? 1 : 0;
  }
  return right;
}

class BackgroundEdge : public ::testing::TestWithParam<ExtractMethod> {
 protected:
  ExtractOptions options() const {
    ExtractOptions options;
    options.method = GetParam();
    return options;
  }
  ExtractOptions options_of_width(double sigma_px) const {
    ExtractOptions options = this->options();
    options.stripe_sigma_px = sigma_px;
    return options;
  }
};

TEST_P(BackgroundEdge, IsNoStripe) {
  constexpr int kLines = 3000;
  ExtractOptions found = options_of_width(1.4);
  for (const PeakRule rule : {PeakRule::kBrightest, PeakRule::kContinuous, PeakRule::kAll}) {
    found.peak = rule;
    for (const double blur_px : {kSharp, 0.8, 2.0, 3.0}) {
      for (const int brighter_dn : {8, 20, 60, -20}) {
        const Stripe stripe =
            extract(with_edge(stripe_of(0.0, kLines), brighter_dn, blur_px), found);
        // A straight background alone finds a stripe in 29 % of the scan lines at least, and in all
        // at most.
        EXPECT_LE(count_good(stripe), kLines / 100)
            << brighter_dn << " DN, blurred by " << blur_px << ", rule " << static_cast<int>(rule);
      }
    }
  }
}

TEST_P(BackgroundEdge, LeavesStripesAboutItAlone) {
  struct Case {
    double amplitude_dn, first, last;
  };
  // On the brighter side, on the darker one (in another block: one holds a single peak), and across
  // it where it is brighter than the edge; and far off on either side a fainter one.
  for (const Case& c : {Case{12, 160, 180}, Case{12, 110, 127}, Case{60, 140, 160},
                        Case{9, 240, 260}, Case{9, 40, 60}}) {
    SyntheticStripe s = stripe_of(c.amplitude_dn, 3000);
    s.position = [&](int line) { return c.first + (c.last - c.first) * line / s.lines; };
    const Stripe stripe = extract(with_edge(s, 20, 0.8), options_of_width(s.sigma_px));
    EXPECT_GE(count_right(stripe, s), s.lines * 99 / 100) << c.first;
  }
}

// The brightest that there is are the edges, at first in all scan lines.
TEST_P(BackgroundEdge, TeachesNoWidth) {
  for (const int brighter_dn : {10, 20, 30, 50}) {
    for (const double amplitude_dn : {15.0, 25.0, 40.0}) {
      SyntheticStripe s = stripe_of(amplitude_dn, 600);
      s.position = [](int) { return 230.3; };
      const Stripe stripe = extract(with_edge(s, brighter_dn, 0.8), options(), 4);
      EXPECT_GE(count_right(stripe, s), s.lines * 99 / 100)
          << "edge of " << brighter_dn << ", stripe of " << amplitude_dn;
    }
  }
}

// On two sides of a block's border, so that both are candidates. The flank of the other may make
// one look narrow.
TEST_P(BackgroundEdge, IsNoBrighterStripe) {
  constexpr double kBorder = 5 * 32 - 0.5;
  for (const double sigma_px : {1.0, 1.5, 2.5}) {
    for (const double distance : {5.0, 9.0}) {
      SyntheticStripe faint = stripe_of(100.0, 200);
      faint.sigma_px = sigma_px;
      faint.position = [&](int) { return kBorder - 0.5 * distance * sigma_px; };
      SyntheticStripe bright = faint;
      bright.amplitude_dn = 150.0;
      bright.background_dn = bright.noise_dn = 0.0;
      bright.position = [&](int) { return kBorder + 0.5 * distance * sigma_px; };
      LitFrame frame = testing::render(faint);
      frame.lit += testing::render(bright).lit;
      ExtractOptions found = options_of_width(sigma_px);
      found.peak = PeakRule::kAll;
      const Stripe stripe = extract(frame, found);
      EXPECT_GE(count_right(stripe, faint, false), 198) << sigma_px << ' ' << distance;
      EXPECT_GE(count_right(stripe, bright), 198) << sigma_px << ' ' << distance;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, BackgroundEdge,
                         ::testing::Values(ExtractMethod::kFast, ExtractMethod::kRefined),
                         [](const auto& instance) {
                           return instance.param == ExtractMethod::kFast ? "Fast" : "Refined";
                         });

}  // namespace
}  // namespace striper
