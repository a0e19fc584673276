// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <striper/model/laser_plane.hpp>
#include <striper/simulator/ideal_look.hpp>
#include <striper/simulator/radiometry.hpp>

#include "light/beam.hpp"

namespace striper {
namespace {

using detail::Beam;
using detail::BeamAt;

// Enough that a width that falls with the range is within 4 % of the straight line between two
// knots over a factor of 20.
constexpr int kKnots = 8;

// So that a person can read what is written: the nearest number of so many parts of 1.
double rounded(double value, double parts) { return std::round(value * parts) / parts; }

struct Knot {
  double range_m;
  double across_px;  // Where in the image.
  double width_px;
  double amplitude_dn;
};

class IdealStripe {
 public:
  IdealStripe(const Scene& scene, int laser)
      : scene_(scene),
        laser_(scene.lasers[static_cast<std::size_t>(laser)]),
        beam_(laser_, scene),
        T_cam_scan_(standard_T_cam_scan(beam_.plane(), scene.axis)) {}

  // The stripe at a range, at the bearing nearest to straight ahead that the image shows.
  std::optional<Knot> at(double range_m) const {
    constexpr double kStepRad = 0.5 * std::numbers::pi / 180.0;
    constexpr int kSteps = 160;  // To 40 degrees on either side.
    for (int step = 0; step <= kSteps; ++step) {
      const double bearing = kStepRad * (step % 2 == 0 ? step / 2 : -(step + 1) / 2);
      if (const auto knot = at(range_m, bearing)) return knot;
    }
    return std::nullopt;
  }

 private:
  bool is_in_image(const Eigen::Vector2d& pixel) const {
    const cv::Rect& region = scene_.imager.region;
    const cv::Rect2d read = region.empty()
                                ? cv::Rect2d(0, 0, scene_.camera.width(), scene_.camera.height())
                                : cv::Rect2d(region);
    return read.contains(cv::Point2d(pixel.x(), pixel.y()));
  }

  std::optional<Knot> at(double range_m, double bearing_rad) const {
    const Eigen::Vector3d point =
        T_cam_scan_ *
        Eigen::Vector3d(range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad), 0.0);
    const Projection seen = scene_.camera.project(point);
    if (seen.status != CameraStatus::kOk || !is_in_image(seen.pixel)) return std::nullopt;
    const Eigen::Vector3d normal = (beam_.origin() - point).normalized();
    const BeamAt light = beam_.at(point, normal);
    const auto height_per_px = slope(seen.pixel, point, normal);
    if (!light.in_fan || !height_per_px) return std::nullopt;

    const Imager& imager = scene_.imager;
    const double thickness_px = light.sigma_m / std::abs(*height_per_px);
    Knot knot{range_m, scene_.axis == StripeAxis::kColumns ? seen.pixel.y() : seen.pixel.x(),
              std::hypot(thickness_px, imager.blur_sigma_px), 0.0};
    const double falloff = std::pow(point.z() / point.norm(), imager.falloff_exponent);
    const double electrons = light.peak_fluence_j_m2 * kWhitePaper / std::numbers::pi * falloff *
                             electrons_per_radiance(imager, laser_.wavelength_nm);
    knot.amplitude_dn = imager.dn_per_electron * electrons * imager.binning.area() *
                        (1.0 - imager.bloom.fraction) * thickness_px / knot.width_px;
    return knot;
  }

  // How far from the laser plane one pixel more across the stripe is, on a surface, metres.
  std::optional<double> slope(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
                              const Eigen::Vector3d& normal) const {
    const Eigen::Vector2d half =
        scene_.axis == StripeAxis::kColumns ? Eigen::Vector2d(0.0, 0.5) : Eigen::Vector2d(0.5, 0.0);
    const Unprojection after = scene_.camera.unproject(pixel + half);
    const Unprojection before = scene_.camera.unproject(pixel - half);
    if (after.status != CameraStatus::kOk || before.status != CameraStatus::kOk) {
      return std::nullopt;
    }
    // d(t r) / dq = t (dr - r (m . dr) / (m . r)) on a surface with the normal m.
    const Eigen::Vector3d ray = point / point.z();
    const Eigen::Vector2d change = after.xy - before.xy;
    const Eigen::Vector3d step(change.x(), change.y(), 0.0);
    return point.z() * beam_.normal().dot(step - normal.dot(step) / normal.dot(ray) * ray);
  }

  const Scene& scene_;
  const SimulatedLaser& laser_;
  Beam beam_;
  Eigen::Isometry3d T_cam_scan_;
};

StripeLook look_of(const std::vector<Knot>& knots) {
  StripeLook look;
  if (knots.empty()) return look;
  look.width_px = rounded(knots[knots.size() / 2].width_px, 1e4);
  if (knots.size() < 2) return look;
  for (const Knot& knot : knots) {
    look.width_at.push_back({rounded(knot.range_m, 1e3), rounded(knot.width_px, 1e4)});
    look.amplitude_at.push_back({rounded(knot.range_m, 1e3), rounded(knot.amplitude_dn, 1e2)});
  }
  // Of a laser that is as good as off, nothing is known.
  if (!(look.amplitude_at.back().amplitude_dn > 0.0)) look.amplitude_at.clear();
  return look;
}

std::vector<Knot> knots_between(const IdealStripe& stripe, double nearest_m, double farthest_m) {
  std::vector<Knot> knots;
  for (int i = 0; i < kKnots; ++i) {
    const double part = static_cast<double>(i) / (kKnots - 1);
    const double range_m = nearest_m * std::pow(farthest_m / nearest_m, part);
    if (const auto knot = stripe.at(range_m)) knots.push_back(*knot);
  }
  return knots;
}

}  // namespace

StripeLook ideal_look(const Scene& scene, int laser, double nearest_m, double farthest_m) {
  return look_of(knots_between(IdealStripe(scene, laser), nearest_m, farthest_m));
}

StripeLook ideal_look(const Scene& scene, int laser) {
  constexpr double kNearest_m = 0.02;
  constexpr double kStep = 1.02;
  constexpr int kSteps = 430;  // To 100 m.
  constexpr double kFaintest_dn = 1.0;
  const IdealStripe stripe(scene, laser);
  std::optional<double> nearest_m;
  double farthest_m = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    const double range_m = kNearest_m * std::pow(kStep, step);
    const auto knot = stripe.at(range_m);
    if (!knot) continue;
    const auto farther = stripe.at(1.25 * range_m);
    const bool is_resolved = !farther || std::abs(farther->across_px - knot->across_px) >= 1.0;
    if (knot->amplitude_dn < kFaintest_dn || !is_resolved) continue;
    if (!nearest_m) nearest_m = range_m;
    farthest_m = range_m;
  }
  if (!nearest_m) return {};
  return look_of(knots_between(stripe, *nearest_m, farthest_m));
}

}  // namespace striper
