// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

namespace striper::detail {

/// A plot of points in data units, drawn as inline SVG.
class SvgPlot {
 public:
  /// @param box what the axes cover. @param y_down as in an image.
  SvgPlot(int width_px, int height_px, const Eigen::AlignedBox2d& box, bool y_down);

  void labels(std::string_view x, std::string_view y);
  void dot(const Eigen::Vector2d& at, double radius_px, std::string_view colour);
  void line(const std::vector<Eigen::Vector2d>& points, std::string_view colour, double width_px);
  void rectangle(const Eigen::Vector2d& low, const Eigen::Vector2d& high, std::string_view fill);
  void text(const Eigen::Vector2d& at, std::string_view words);

  std::string finish() const;

 private:
  Eigen::Vector2d place(const Eigen::Vector2d& at) const;
  void ticks();

  int width_;
  int height_;
  Eigen::AlignedBox2d box_;
  bool y_down_;
  std::string x_label_;
  std::string y_label_;
  std::string body_;
};

/// A colour from dark blue (0) over green to yellow (1).
std::string heat_colour(double value);

/// Text with the characters that HTML gives a meaning replaced.
std::string escape_html(std::string_view text);

}  // namespace striper::detail
