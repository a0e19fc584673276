// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/curb_calibration.hpp"

#include <cmath>

#include "profile/scan_line.hpp"
#include "profile/tools/calibration_modes.hpp"

namespace striper::detail {
namespace {

// Places on a surface that stand for its returns: the fits of 5 and of 100 differ by 4 % of what
// bends.
constexpr int kNodes = 5;

// Shorter, and a surface has no direction of its own.
constexpr double kLeastLength_m = 0.01;

// The model, wrong by `by` in the order of Triangulator::covariance. A scan frame that the file
// moved keeps its place beside the standing one.
StriperModel wrong_model(const StriperModel& model, int laser, const Eigen::VectorXd& by) {
  StriperModel wrong = model;
  Eigen::VectorXd camera = model.camera.parameters();
  camera += by.head(camera.size());
  wrong.camera = model.camera.with_parameters(camera);
  Laser& one = wrong.lasers[static_cast<std::size_t>(laser)];
  const LaserPlane plane = one.plane;
  const Eigen::Vector4d of_plane = by.tail<4>();
  one.plane = LaserPlane((plane.normal() + of_plane.head<3>()).normalized(),
                         plane.distance_m() + of_plane[3]);
  if (one.moved_T_cam_scan) {
    one.moved_T_cam_scan = standard_T_cam_scan(one.plane, model.axis) *
                           standard_T_cam_scan(plane, model.axis).inverse() * *one.moved_T_cam_scan;
  }
  return wrong;
}

}  // namespace

CurbCalibration::CurbCalibration(const StriperModel& model, int laser,
                                 const Eigen::Vector2d& pivot_m)
    : right_(model, laser), pivot_m_(pivot_m) {
  const CalibrationModes modes(right_);
  for (Eigen::Index k = 0; k < modes.root().cols(); ++k)
    wrong_.emplace_back(wrong_model(model, laser, modes.root().col(k)), laser);
}

void CurbCalibration::judge(CurbFinding& finding) const noexcept {
  if (!finding.road_m.allFinite() || !finding.top_m.allFinite()) return;
  const Figures right = figures(finding, right_);
  double lateral = 0.0;
  double height = 0.0;
  for (const Triangulator& one : wrong_) {
    const Figures wrong = figures(finding, one);
    lateral += (wrong.lateral_m - right.lateral_m) * (wrong.lateral_m - right.lateral_m);
    height += (wrong.height_m - right.height_m) * (wrong.height_m - right.height_m);
  }
  finding.sigma_cal_lateral_m = std::sqrt(lateral);
  finding.sigma_cal_height_m = std::sqrt(height);
}

// Where a striper that is wrong takes a place to be.
Eigen::Vector2d CurbCalibration::moved(const Eigen::Vector2d& at_m,
                                       const Triangulator& wrong) const noexcept {
  const PlanePoint there = wrong.triangulate(right_.project(at_m.x(), at_m.y()).pixel);
  return {there.x_m, there.y_m};
}

// As returns are fitted that are equally spaced in bearing.
ScanLine CurbCalibration::line(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m,
                               const Triangulator& wrong) const noexcept {
  const Eigen::Vector2d from = from_m - pivot_m_;
  const Eigen::Vector2d along = to_m - from_m;
  const Eigen::Vector2d normal(along.y(), -along.x());
  LineSums sums;
  for (int k = 0; k < kNodes; ++k) {
    const double part = (k + 0.5) / kNodes;
    const Eigen::Vector2d ray =
        (1.0 - part) * from.normalized() + part * (to_m - pivot_m_).normalized();
    const Eigen::Vector2d at = from.dot(normal) / ray.dot(normal) * ray;
    const Eigen::Vector2d seen = moved(pivot_m_ + at, wrong) - pivot_m_;
    const double q = 1.0 / seen.norm();
    sums.add(seen.x() * q, seen.y() * q, q, 1.0);
  }
  return scan_line(sums.solve(), 1.0, pivot_m_);
}

CurbCalibration::Figures CurbCalibration::figures(const CurbFinding& f,
                                                  const Triangulator& wrong) const noexcept {
  const ScanLine road = line(f.road_m, f.foot_m, wrong);
  Eigen::Vector2d foot = moved(f.foot_m, wrong);
  Eigen::Vector2d top = moved(f.top_m, wrong);
  const bool is_rise = f.road.offset_m(f.top_m) < 0.0;
  if (is_rise) {
    const ScanLine face = line(f.foot_m, f.top_m, wrong);
    foot = meeting(road, face);
    if ((f.beyond_m - f.top_m).norm() > kLeastLength_m)
      top = meeting(face, line(f.top_m, f.beyond_m, wrong));
  }
  return {std::abs(road.direction().dot(foot)), std::abs(road.offset_m(top))};
}

}  // namespace striper::detail
