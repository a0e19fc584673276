// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string_view>

#include <Eigen/Core>

#include <striper/profile/segments.hpp>

namespace striper {

/// What the ground does beyond the road.
enum class CurbKind {
  kNone,    ///< It goes on.
  kUp,      ///< A face rises to a surface that can be stood on.
  kDown,    ///< It goes on lower; the face is out of sight.
  kRamp,    ///< It rises, too flat for a face.
  kWall,    ///< A face too high for a curb: a wall, a vehicle.
  kObject,  ///< Something that stands on the road: there is road behind it.
  kRough    ///< Grass, gravel, snow: no surface.
};
inline constexpr std::size_t kCurbKindCount = 7;

/// `none`, `up`, `down`, `ramp`, `wall`, `object`, `rough`. Static storage.
std::string_view to_string(CurbKind kind) noexcept;

/// What one scan shows where the road ends on one side: road, face and top as a line of four
/// vertices.
///
/// The foot is where the road's line meets the face's, the edge where the face's meets the top's;
/// the height is the edge's distance from the road's line; lateral is the foot's place along that
/// line from the sensor's own foot point. So a rounded nose or a slanted face leaves no doubt about
/// what is meant. Of kind down the foot is the last of the road that is seen: the road may end up
/// to `sigma_lateral_m` times the root of 12 beyond. Scan frame; NaN where it is not known.
struct CurbFinding {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  CurbKind kind = CurbKind::kNone;                 ///< The most probable one.
  std::array<double, kCurbKindCount> posterior{};  ///< Of each, by this scan alone; the sum is 1.

  Eigen::Vector2d road_m{kUnknown, kUnknown};  ///< Where the road's last straight piece begins.
  Eigen::Vector2d foot_m{kUnknown, kUnknown};
  Eigen::Vector2d top_m{kUnknown, kUnknown};     ///< The edge.
  Eigen::Vector2d beyond_m{kUnknown, kUnknown};  ///< How far the top is seen.
  Eigen::Matrix4d covariance =
      Eigen::Matrix4d::Constant(kUnknown);  ///< Of foot and edge, random error alone.

  double lateral_m = kUnknown;
  double sigma_lateral_m = kUnknown;
  double height_m = kUnknown;  ///< Positive, of kind down too.
  double sigma_height_m = kUnknown;
  /// Of the calibration, common to all scans: never averaged down. NaN without its covariance.
  double sigma_cal_lateral_m = kUnknown;
  double sigma_cal_height_m = kUnknown;
  double face_rad = kUnknown;  ///< From the road to the face; pi / 2 is upright.
  double sigma_face_rad = kUnknown;
  ScanLine road;  ///< The last straight piece of the ground before the face.
  /// ln p(returns beyond the edge | overgrown) - ln p(... | paved); 0 where they do not tell.
  double overgrown_log_odds = 0.0;

  double of(CurbKind wanted) const noexcept { return posterior[static_cast<std::size_t>(wanted)]; }
  /// That it is a curb, up or down, by this scan alone.
  double probability() const noexcept { return of(CurbKind::kUp) + of(CurbKind::kDown); }
};

}  // namespace striper
