// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace striper::program {

/// What one axis of a chart shows.
struct ChartAxis {
  std::string label;
  double low = 0.0;
  double high = 1.0;
  bool is_logarithmic = false;
};

/// A chart as SVG: lines and dots over two axes, each linear or logarithmic, with a key. What lies
/// outside the axes, or is not finite, is left out.
class SvgChart {
 public:
  /// @param equal_scale a unit is as long along both axes (a plot from above): the taller axis
  /// decides. Linear axes only.
  SvgChart(std::string title, ChartAxis x, ChartAxis y, bool equal_scale = false);

  void line(const std::string& name, const std::string& colour,
            const std::vector<Eigen::Vector2d>& points);
  void dots(const std::string& name, const std::string& colour, double radius_px,
            const std::vector<Eigen::Vector2d>& points);
  /// Thin strokes from a to b, as error bars are.
  void bars(const std::string& name, const std::string& colour,
            const std::vector<Eigen::Vector2d>& from, const std::vector<Eigen::Vector2d>& to);

  double height_px() const noexcept { return height_px_; }

  /// The chart as a group whose top is `top_px` below the plot's.
  std::string group(double top_px) const;

  static constexpr double kWidth_px = 760.0;

 private:
  void add_key(const std::string& name, const std::string& colour);
  bool shows(const Eigen::Vector2d& point) const;
  Eigen::Vector2d place(const Eigen::Vector2d& point) const;
  std::string grid() const;

  std::string title_;
  ChartAxis x_;
  ChartAxis y_;
  double height_px_ = 380.0;
  std::string body_;
  std::string key_;
  int keys_ = 0;
};

/// Charts one below the other as one SVG file's text.
std::string svg_of(const std::vector<SvgChart>& charts);

}  // namespace striper::program
