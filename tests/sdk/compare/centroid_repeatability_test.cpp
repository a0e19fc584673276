// SPDX-License-Identifier: Apache-2.0
// Proves that what a three-pixel centroid is said to change by is what drawn noise makes of it, at
// which ratio it is the paper's 0.3, and that whole frames, extracted by the paper's method and
// compared by `repeatability`, change so; with the refined method beside it.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/compare/centroid_repeatability.hpp>
#include <striper/compare/scan_comparison.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/error_of.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using testing::error_of;
using testing::normal;
using testing::uniform;

// The centroid of a stripe in drawn noise.
double drawn_centroid(double sigma_px, double phase_px, double snr) {
  constexpr int kPixels = 25;
  constexpr int kMiddle = kPixels / 2;
  std::vector<double> values(kPixels);
  const double height = sigma_px * std::sqrt(0.5 * std::numbers::pi);
  for (int k = 0; k < kPixels; ++k) {
    const double off = k - kMiddle - phase_px;
    const double scale = sigma_px * std::numbers::sqrt2;
    values[static_cast<std::size_t>(k)] =
        height * (std::erf((off + 0.5) / scale) - std::erf((off - 0.5) / scale)) + normal() / snr;
  }
  const auto peak = std::max_element(values.begin() + 1, values.end() - 1);
  const double before = std::max(0.0, *(peak - 1));
  const double after = std::max(0.0, *(peak + 1));
  return static_cast<double>(peak - values.begin()) + (after - before) / (before + *peak + after);
}

TEST(CentroidChange, IsThatOfDrawnNoise) {
  for (const auto& [sigma_px, snr] :
       {std::pair(0.7, 8.0), std::pair(0.7, 20.0), std::pair(1.2, 9.0), std::pair(1.2, 40.0),
        std::pair(2.0, 21.0), std::pair(2.0, 60.0)}) {
    constexpr int kDraws = 40000;
    double sum = 0.0;
    for (int n = 0; n < kDraws; ++n) {
      const double phase_px = uniform(-0.5, 0.5);
      sum += std::abs(drawn_centroid(sigma_px, phase_px, snr) -
                      drawn_centroid(sigma_px, phase_px, snr));
    }
    const double said = centroid_change_px(sigma_px, snr);
    EXPECT_NEAR(sum / kDraws / said, 1.0, 0.02) << sigma_px << " " << snr;
  }
}

TEST(CentroidChange, IsThePapersThirdAtTheseRatios) {
  EXPECT_NEAR(centroid_snr(0.7, 0.3), 5.0, 0.4);
  EXPECT_NEAR(centroid_snr(1.2, 0.3), 8.0, 0.4);
  EXPECT_NEAR(centroid_snr(2.0, 0.3), 21.0, 1.0);
}

TEST(CentroidChange, RefusesWhatItCannotSay) {
  EXPECT_THAT(error_of([] { centroid_change_px(0.1, 10.0); }).what(),
              ::testing::HasSubstr("sigma_px is 0.1, expected 0.3 to 5"));
  EXPECT_THAT(error_of([] { centroid_change_px(1.0, std::nan("")); }).what(),
              ::testing::HasSubstr("snr is nan, expected 2 to"));
  EXPECT_THAT(error_of([] { centroid_snr(1.0, 0.0); }).what(),
              ::testing::HasSubstr("change_px is 0, expected 0.02 to 1"));
}

// ---- Whole frames.

constexpr double kDnPerElectron = 0.25;

// A wall whose stripe crosses the pixels at all phases, every other exposure dark.
Scene wall_with(double blur_px) {
  Scene scene = Scene::flat_wall(2.0);
  scene.camera = Scene::pinhole(320, 240, 30.0);
  constexpr double kPitch_rad = 0.245;  // The laser is 0.5 m below.
  scene.camera_rotation = (Eigen::AngleAxisd(kPitch_rad, Eigen::Vector3d::UnitY()) *
                           Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX()))
                              .toRotationMatrix();
  scene.lasers.front().divergence_sigma_rad = 2e-5;
  scene.imager.blur_sigma_px = blur_px;
  scene.imager.bit_depth = 16;
  scene.imager.dn_per_electron = kDnPerElectron;
  scene.timing.pattern = IlluminationPattern::parse("0,dark");
  return scene;
}

struct Measured {
  double paper_px = 0.0;
  double refined_px = 0.0;
  double said_px = 0.0;
};

double change_of(Simulator& simulator, ScannerOptions options) {
  constexpr std::uint64_t kImages = 120;
  options.ambient.pattern = simulator.scene().timing.pattern;
  Scanner scanner(simulator.model(), options);
  std::vector<PolarScan> scans;
  int seen = 0;
  for (std::uint64_t n = 0; n < kImages; ++n) {
    for (const PolarScan& scan : scanner.process(simulator.render(n))) {
      // Lit exposures that follow each other share the dark one between them.
      if (seen++ % 2 == 0) scans.push_back(scan);
    }
  }
  return repeatability(scans).mean_change_px;
}

Measured measure(double blur_px, double snr) {
  Scene scene = wall_with(blur_px);
  const TrueReturn middle = Simulator(scene).truth(0).at(0).lines.at(160).brightest;
  // Of lit minus the mean of the dark exposures before and after it.
  const double noise_dn = middle.amplitude_dn / snr / std::sqrt(1.5);
  scene.imager.noise.shot = false;
  scene.imager.noise.read_noise_e = noise_dn / kDnPerElectron;
  scene.imager.black_level_dn = 8.0 * noise_dn;
  Simulator simulator(scene);
  Measured measured;
  ScannerOptions options = ScannerOptions::for_model(simulator.model());
  measured.refined_px = change_of(simulator, options);
  options.stripe.method = ExtractMethod::kPaper;
  measured.paper_px = change_of(simulator, options);
  measured.said_px = centroid_change_px(middle.width_px, snr);
  return measured;
}

TEST(CentroidChange, IsThatOfFramesByThePapersMethod) {
  for (const auto& [blur_px, snr] :
       {std::pair(0.7, 12.0), std::pair(1.2, 9.0), std::pair(2.0, 21.0)}) {
    const Measured measured = measure(blur_px, snr);
    SCOPED_TRACE(fmt::format("sigma {} px, SNR {}: paper {:.4f} px, refined {:.4f} px, said {:.4f}",
                             blur_px, snr, measured.paper_px, measured.refined_px,
                             measured.said_px));
    RecordProperty(fmt::format("paper_{}", blur_px), fmt::format("{:.4f}", measured.paper_px));
    RecordProperty(fmt::format("refined_{}", blur_px), fmt::format("{:.4f}", measured.refined_px));
    RecordProperty(fmt::format("said_{}", blur_px), fmt::format("{:.4f}", measured.said_px));
    EXPECT_NEAR(measured.paper_px / measured.said_px, 1.0, 0.05);
    EXPECT_LT(measured.refined_px, measured.paper_px);
  }
}

}  // namespace
}  // namespace striper
