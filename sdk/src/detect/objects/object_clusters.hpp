// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/detect/objects.hpp>

namespace striper::detail {

/// What is ground: the road's line and how much higher it is beyond each curb.
struct ObjectGround {
  ScanLine road;
  Eigen::Vector2d along{1.0, 0.0};
  struct Step {
    double from_m = 0.0;  // Lateral.
    double out = 1.0;     // Sign of lateral beyond it.
    double height_m = 0.0;
  };
  std::array<std::optional<Step>, 2> steps;

  double height_m(const Eigen::Vector2d& p_scan) const noexcept;
};

/// A group of returns and the face of it that is nearest.
struct ObjectCluster {
  std::size_t first = 0;  ///< Of the sorted returns.
  std::size_t last = 0;   ///< Included.
  double width_m = 0.0;
  bool are_ends_seen = false;  ///< Both, against something farther.

  Eigen::Vector2d closest_m{0.0, 0.0};
  Eigen::Matrix2d closest_covariance = Eigen::Matrix2d::Zero();

  Eigen::Vector2d normal{1.0, 0.0};  ///< Of the nearest face, away from the sensor.
  double sigma_normal_rad = 0.0;
  /// What is tracked: the middle between the ends, on the face; where not both are seen the
  /// closest point.
  Eigen::Vector2d anchor_m{0.0, 0.0};
  double normal_variance = 0.0;   ///< Of the anchor along the normal,
  double tangent_variance = 0.0;  ///< and along the face; where the ends are not seen of its place
                                  ///< on the object.

  Eigen::Vector2d tangent() const { return {-normal.y(), normal.x()}; }
  Eigen::Matrix2d covariance() const {
    return normal_variance * normal * normal.transpose() +
           tangent_variance * tangent() * tangent().transpose();
  }
};

/// Whether an object that was not found could have been seen.
enum class ObjectLook { kClear, kHidden, kOutside };

/// Groups the returns of scans. No allocation after the largest scan; not thread-safe.
class ObjectClusters {
 public:
  void find(const PolarScan& scan, const ObjectOptions& options,
            const std::optional<ObjectGround>& ground);

  const std::vector<ObjectCluster>& found() const noexcept { return clusters_; }

  /// What this scan shows where an object should be.
  ObjectLook look(const Eigen::Vector2d& centre_m, double width_m) const noexcept;

 private:
  struct Point {
    double bearing_rad, range_m, sigma_m;
    Eigen::Vector2d at_m;
    bool is_ground;
  };
  struct Face;

  void collect(const PolarScan& scan, const ObjectOptions& options,
               const std::optional<ObjectGround>& ground);
  void close_circle(const ObjectOptions& options);
  double typical_spacing();
  bool are_apart(const Point& a, const Point& b, const ObjectOptions& options) const noexcept;
  bool is_end_seen(std::size_t at, std::ptrdiff_t step) const noexcept;
  Face face_of(std::size_t first, std::size_t last) const noexcept;
  void add(std::size_t first, std::size_t last, const ObjectOptions& options);

  std::vector<Point> points_;  // Ascending in bearing.
  std::vector<double> gaps_;
  std::vector<ObjectCluster> clusters_;
  double spacing_rad_ = 0.0;
  double empty_before_rad_ = 0.0;  // Rays without a return beyond the outermost ones.
  double empty_after_rad_ = 0.0;
  bool is_circle_ = false;
};

}  // namespace striper::detail
