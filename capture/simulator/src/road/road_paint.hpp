// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <striper/road/road.hpp>

namespace striper::detail {

/// How much paint a spot of light meets, and how bright that is.
class RoadPaint {
 public:
  explicit RoadPaint(const Road& road);

  /// What meets the road at a place, across it.
  struct Cut {
    double left_m = 0.0;
    double right_m = 0.0;
    double brightness = 0.0;  ///< Beside new white paint, in this cut.
  };
  /// All paint at a place along the road. @param spot_m the light's length along it.
  void cut(double along_m, double spot_m, std::vector<Cut>& cuts) const;

  /// Whether half the width of a line's paint is there.
  bool is_painted(double along_m, int line) const noexcept;
  const RoadLine* line(int line) const noexcept;

  void paint(double from_m, double to_m, double lateral_m);
  /// Where the gun has painted there; NaN where it has not.
  double fresh_at(double along_m) const noexcept;

  /// 0 to 1: a texture that does not change.
  double texture(double along_m, double lateral_m) const noexcept;

 private:
  struct Edges {
    std::vector<double> left_m;  // Worn off, every centimetre.
    std::vector<double> right_m;
  };
  struct Dash {
    double from_m;
    double to_m;
  };
  double presence(std::size_t line, double along_m, double spot_m) const noexcept;

  Road road_;
  std::vector<Edges> edges_;  // Of each line.
  std::vector<std::vector<Dash>> dashes_;
  std::vector<double> fresh_m_;  // Lateral, every centimetre.
  struct Bar {
    double from_m, to_m, left_m, right_m, brightness;
  };
  std::vector<Bar> bars_;
};

}  // namespace striper::detail
