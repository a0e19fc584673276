// SPDX-License-Identifier: Apache-2.0
// Proves that what `DesignFigures` predicts is what the whole pipeline then measures: on rendered
// frames of a sunlit wall, over three lenses, four ranges and three reflectances, the spread of the
// ranges and the signal to background; and of dim stripes how many are found, through two lenses.
// Does not prove that a real camera is as the renderer's.
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <striper/design/design_figures.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/instrumented.hpp"

namespace striper {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr int kColumns = 160;
constexpr int kRows = 480;
constexpr double kTilt_rad = 14.0 * kDegree;
constexpr std::uint64_t kFrames = 50;

// A camera of 640 x 480 of which the middle columns are read, tilted so that 1.2 to 3.8 m are seen.
Scene sunlit_wall(double fov_deg, double range_m, double reflectance) {
  Scene scene = Scene::flat_wall(range_m);
  const double focal_px = 640.0 / (fov_deg * kDegree);
  scene.camera = CameraModel(kColumns, kRows, focal_px, focal_px, 0.5 * (kColumns - 1),
                             0.5 * (kRows - 1), LensModel::kEquidistant, {0.0, 0.0, 0.0, 0.0});
  scene.camera_rotation = Eigen::AngleAxisd(kTilt_rad, Eigen::Vector3d::UnitY()).toRotationMatrix();
  scene.objects[0].material.reflectance = reflectance;
  scene.daylight.sun_w_m2_nm = 0.856;
  scene.daylight.sun_direction = -Eigen::Vector3d::UnitX();  // Square on the wall.
  scene.imager.bit_depth = 12;
  scene.imager.dn_per_electron = 0.25;
  scene.imager.black_level_dn = 100.0;
  scene.imager.noise.read_noise_e = 15.0;
  return scene;
}

StriperDesign design_of(const Scene& scene, double reflectance) {
  StriperDesign design = place_laser(scene.camera, 0.5, kTilt_rad);
  design.sun.spectral_w_m2_nm = scene.daylight.sun_w_m2_nm;
  design.camera.bit_depth = scene.imager.bit_depth;
  design.camera.dn_per_electron = scene.imager.dn_per_electron;
  design.camera.black_level_dn = scene.imager.black_level_dn;
  design.camera.read_noise_e = scene.imager.noise.read_noise_e;
  design.reflectance = reflectance;
  return design;
}

// What a column shows over the frames.
struct ColumnSum {
  int count = 0;
  double range = 0.0;
  double range2 = 0.0;
  double intensity = 0.0;
  double bearing = 0.0;
};

std::vector<ColumnSum> measure(Simulator& simulator) {
  const StriperModel model = simulator.model();
  ScannerOptions options = ScannerOptions::for_model(model);
  options.ambient.pattern = IlluminationPattern::parse("0");
  Scanner scanner(model, options);
  std::vector<ColumnSum> columns(kColumns);
  for (std::uint64_t n = 0; n < kFrames; ++n) {
    for (const PolarScan& scan : scanner.process(simulator.render(n))) {
      for (std::size_t i = 0; i < scan.returns.size(); ++i) {
        const Return& r = scan.returns[i];
        if (r.status != ReturnStatus::kOk) continue;
        ++columns[i].count;
        columns[i].range += r.range_m;
        columns[i].range2 += r.range_m * r.range_m;
        columns[i].intensity += static_cast<double>(r.intensity_dn);
        columns[i].bearing = r.bearing_rad;
      }
    }
  }
  return columns;
}

// Measured over predicted, pooled over the columns.
struct Comparison {
  int returns = 0;
  double sigma_ratio = 0.0;
  double background_ratio = 0.0;
};

double background_dn(Simulator& simulator) {
  const cv::Mat image = simulator.expected_dn(0);  // A corner of it, away from the stripe.
  return static_cast<double>(image.at<float>(2, 2)) - simulator.scene().imager.black_level_dn;
}

Comparison compare(Simulator& simulator, const DesignFigures& figures) {
  const double shown_background_dn = background_dn(simulator);
  Comparison result;
  double variance = 0.0;
  double ratio = 0.0;
  int columns = 0;
  for (const ColumnSum& column : measure(simulator)) {
    if (column.count < 0.9 * kFrames) continue;
    const double mean = column.range / column.count;
    const double spread2 =
        (column.range2 / column.count - mean * mean) * column.count / (column.count - 1.0);
    const RangeFigures at = figures.at(mean, column.bearing);
    variance += spread2 / (at.sigma_m * at.sigma_m);
    // The wall faces the sun, and the laser but for the bearing; what a pixel integrates is lower.
    const double pixel = std::sqrt(1.0 + 1.0 / (12.0 * at.width_px * at.width_px));
    const double amplitude_dn = pixel * column.intensity / column.count;
    ratio +=
        amplitude_dn / shown_background_dn / (at.signal_to_background * std::cos(column.bearing));
    result.returns += column.count;
    ++columns;
  }
  result.sigma_ratio = std::sqrt(variance / columns);
  result.background_ratio = ratio / columns;
  return result;
}

// The dimmest wall whose stripe is found in this part of the scan lines, as predicted.
double reflectance_found(double fov_deg, double range_m, double detection) {
  double low = 1e-4;
  double high = 1.0;
  for (int n = 0; n < 40; ++n) {
    const double middle = std::sqrt(low * high);
    const Scene scene = sunlit_wall(fov_deg, range_m, middle);
    const RangeFigures at = DesignFigures(design_of(scene, middle)).at(range_m);
    (at.detection < detection ? low : high) = middle;
  }
  return high;
}

// Part of the scan lines in which the pipeline finds the stripe where it is.
double found_part(double fov_deg, double range_m, double reflectance) {
  Simulator simulator(sunlit_wall(fov_deg, range_m, reflectance));
  const StriperModel model = simulator.model();
  ScannerOptions options = ScannerOptions::for_model(model);
  options.ambient.pattern = IlluminationPattern::parse("0");
  Scanner scanner(model, options);
  int found = 0;
  int lines = 0;
  for (std::uint64_t n = 0; n < kFrames; ++n) {
    for (const PolarScan& scan : scanner.process(simulator.render(n))) {
      lines += kColumns;
      for (const Return& r : scan.returns) {
        found += std::abs(r.range_m * std::cos(r.bearing_rad) - range_m) < 0.1 * range_m ? 1 : 0;
      }
    }
  }
  return static_cast<double>(found) / lines;
}

// The prediction is on the safe side: where half is predicted, up to a fifth more is found. Through
// 30 degrees, where this stripe is level and narrow, whole frames lose a part of it: not proved.
TEST(PredictedAndMeasured, DetectionOfADimStripe) {
  for (const double fov_deg : {55.0, 105.0}) {
    for (const double detection : {0.5, 0.9}) {
      SCOPED_TRACE(fmt::format("{:g} degrees, predicted {:g}", fov_deg, detection));
      const double found = found_part(fov_deg, 2.6, reflectance_found(fov_deg, 2.6, detection));
      EXPECT_GT(found, detection - 0.03);
      EXPECT_LT(found, detection + 0.13 * (1.0 - detection) / 0.5 + 0.03);
    }
  }
}

TEST(PredictedAndMeasured, SigmaAndSignalToBackgroundOver36Cases) {
  STRIPER_SKIP_FIGURES_WHERE_INSTRUMENTED();
  int cases = 0;
  for (const double fov_deg : {30.0, 55.0, 105.0}) {
    for (const double range_m : {1.2, 1.8, 2.6, 3.8}) {
      for (const double reflectance : {0.1, 0.3, 0.8}) {
        const Scene scene = sunlit_wall(fov_deg, range_m, reflectance);
        const DesignFigures figures(design_of(scene, reflectance));
        const RangeFigures at = figures.at(range_m);
        ASSERT_FALSE(at.is_clipped);
        if (!(at.detection >= 0.99)) continue;
        Simulator simulator(scene);
        const Comparison measured = compare(simulator, figures);
        SCOPED_TRACE(fmt::format("{:g} degrees, {:g} m, reflectance {:g}, SNR {:.1f}", fov_deg,
                                 range_m, reflectance, at.snr));
        RecordProperty(fmt::format("ratio_{}", cases), fmt::format("{:.4f}", measured.sigma_ratio));
        // 7200 or more returns know their own spread to .9 %.
        EXPECT_GE(measured.returns, 0.9 * kColumns * kFrames);
        EXPECT_NEAR(measured.sigma_ratio, 1.0, 0.05);
        EXPECT_NEAR(measured.background_ratio, 1.0, 0.05);
        ++cases;
      }
    }
  }
  EXPECT_GE(cases, 30);
}

}  // namespace
}  // namespace striper
