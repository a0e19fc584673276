// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <striper/core/units.hpp>
#include <striper/design/design_figures.hpp>
#include <striper/design/paper_table.hpp>

namespace striper {
namespace {

constexpr double kTableRange_m = 2.0;
constexpr double kFittedFov_deg = 55.0;
constexpr double kFittedMaxRange_m = 5.2;

double scaled_max_range_m(double fov_deg) {
  const double focal = 1.0 / std::tan(0.5 * fov_deg * kDegree);
  const double fitted_focal = 1.0 / std::tan(0.5 * kFittedFov_deg * kDegree);
  return kFittedMaxRange_m * std::sqrt(focal / fitted_focal);
}

}  // namespace

StriperDesign paper_striper(double fov_deg) {
  constexpr double kBaseline_m = 0.5;
  // The paper does not print how its cameras look; level, the 30 degree lens would not show 2 m.
  const double tilt_rad = std::atan2(kBaseline_m, kTableRange_m);
  StriperDesign design =
      place_laser(equiangular_camera(640, 480, fov_deg * kDegree), kBaseline_m, tilt_rad);
  design.laser.pulse_energy_j = 10.43e-6;
  design.camera.interlaced = true;
  return design;
}

std::array<PaperLens, 3> paper_table_1() {
  std::array<PaperLens, 3> lenses = {
      {{30.0, 0.05, 7.0, 0.014}, {55.0, 0.09, 5.2, 0.026}, {105.0, 0.16, 3.0, 0.050}}};
  for (PaperLens& lens : lenses) {
    const DesignFigures figures(paper_striper(lens.fov_deg));
    const RangeFigures at = figures.at(kTableRange_m);
    lens.resolution_deg = figures.angular_resolution_rad() / kDegree;
    lens.step_m = at.step_out_m;
    lens.derivative_m = at.step_derivative_m;
    lens.scaled_max_range_m = scaled_max_range_m(lens.fov_deg);
  }
  return lenses;
}

}  // namespace striper
