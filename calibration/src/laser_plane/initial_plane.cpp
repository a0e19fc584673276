// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <Eigen/Dense>

#include <striper/core/robust.hpp>
#include <striper/laser_plane/initial_plane.hpp>

namespace striper {
namespace {

constexpr int kTrials = 400;
constexpr std::size_t kScored = 600;  // Points that a candidate is judged by.

struct RawPlane {
  Eigen::Vector3d normal;
  double distance_m;
};

double median_distance_m(const RawPlane& plane, const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const auto& p : points)
    distances.push_back(std::abs(plane.normal.dot(p) - plane.distance_m));
  return upper_median(distances);
}

std::optional<RawPlane> least_squares(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < 3) return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  if (eigen.eigenvalues()[1] < 1e-14 * eigen.eigenvalues()[2]) return std::nullopt;
  const Eigen::Vector3d normal = eigen.eigenvectors().col(0);
  return RawPlane{normal, normal.dot(mean)};
}

std::vector<Eigen::Vector3d> thinned(const std::vector<Eigen::Vector3d>& points) {
  const std::size_t step = std::max<std::size_t>(1, points.size() / kScored);
  std::vector<Eigen::Vector3d> some;
  for (std::size_t i = 0; i < points.size(); i += step) some.push_back(points[i]);
  return some;
}

}  // namespace

std::optional<LaserPlane> fit_plane(const std::vector<Eigen::Vector3d>& points_cam) {
  if (points_cam.size() < 3) return std::nullopt;
  const std::vector<Eigen::Vector3d> judges = thinned(points_cam);
  std::mt19937 generator(1984);  // NOLINT: the same draws every time is what is wanted.
  std::optional<RawPlane> best;
  double best_median_m = std::numeric_limits<double>::infinity();
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto& a = points_cam[generator() % points_cam.size()];
    const auto& b = points_cam[generator() % points_cam.size()];
    const auto& c = points_cam[generator() % points_cam.size()];
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() < 1e-9 * (b - a).norm() * (c - a).norm() || normal.norm() == 0.0) continue;
    const RawPlane plane{normal.normalized(), normal.normalized().dot(a)};
    const double median_m = median_distance_m(plane, judges);
    if (median_m < best_median_m) {
      best_median_m = median_m;
      best = plane;
    }
  }
  if (!best) return std::nullopt;
  const double gate_m = std::max(2.5 * kSigmaOfMedianAbsolute * best_median_m, 1e-9);
  std::vector<Eigen::Vector3d> inliers;
  for (const auto& p : points_cam)
    if (std::abs(best->normal.dot(p) - best->distance_m) <= gate_m) inliers.push_back(p);
  if (const auto refined = least_squares(inliers)) best = refined;
  return LaserPlane(best->normal, best->distance_m);
}

}  // namespace striper
