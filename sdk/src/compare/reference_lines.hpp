// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/compare/scan_comparison.hpp>

namespace striper::detail {

/// How far from straight a surface may be and still count as such, besides rounding and noise: what
/// plaster and edges that are not sharp have. Over neighbours it is one error, not many.
inline constexpr double kStraight_m = 0.003;

/// The surface that a reference sees about one bearing: a straight line.
struct ReferenceLine {
  enum class Status { kFound, kNotVisible, kNoSegment } status = Status::kNoSegment;
  Eigen::Vector2d point = Eigen::Vector2d::Zero();   // On the line.
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();  // Unit length, towards the reference.
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();     // Unit length, from the reference.
  double sigma_m = 0.0;                              // Random, along the ray.
  double sigma_normal_rad = 0.0;                     // Of the normal's direction.
  double sigma_turn_rad = 0.0;  // The same of a straight surface, where rounding is no chance.
  double bend_m = 0.0;          // How far the surface is from the line, off its ends and middle.
  double sigma_off_m = 0.0;     // Across the line, where it was asked for: of direction and bend.
  double roundings = 1.0;  // Over how many independent ones the reference's rounding is averaged.
};

/// A reference's scan as lines between neighbouring returns.
class ReferenceLines {
 public:
  /// @throws Error{kUntrustworthy} where it has too few returns.
  ReferenceLines(const PolarScan& reference, const CompareOptions& options);

  /// What the reference sees in the direction of a point of its own frame.
  /// @param gate_m how far behind or before it a point may lie to be of the same surface.
  ReferenceLine about(const Eigen::Vector2d& p_reference, double gate_m) const;

  /// Whether it has a surface in the direction of a point, wherever on that ray the point is.
  bool looks_at(const Eigen::Vector2d& p_reference) const;

 private:
  struct Beam {
    double bearing_rad;
    double range_m;
    double sigma_m;
    Eigen::Vector2d point;
  };

  std::optional<std::size_t> beam_before(const Eigen::Vector2d& p_reference) const;
  bool is_joined(std::size_t first) const;
  void split(std::size_t first, std::size_t last);
  void add_lines(std::size_t first, std::size_t last);
  bool is_off(std::size_t end, std::size_t first, std::size_t last) const;
  double bend_m(std::size_t first, std::size_t last, const ReferenceLine& line) const;
  double sigma_m(const ReferenceLine& line) const;
  ReferenceLine line_through(std::size_t first, std::size_t last) const;
  double independent_roundings(std::size_t first, std::size_t last) const;

  std::vector<Beam> beams_;           // Rising bearing.
  std::vector<ReferenceLine> lines_;  // Element i through beams i and i + 1.
  CompareOptions options_;
  double usual_step_rad_ = 0.0;
};

}  // namespace striper::detail
