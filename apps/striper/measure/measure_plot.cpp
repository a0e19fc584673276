// SPDX-License-Identifier: Apache-2.0
#include "measure/measure_plot.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "program/svg_chart.hpp"

namespace striper::program {
namespace {

using Vector = Eigen::Vector2d;
using Vectors = std::vector<Vector>;

constexpr std::size_t kMostValues = 1000;
constexpr std::size_t kMostCharts = 12;
// Error bars of corners and ends are smaller than a pixel of the plot.
constexpr double kEnlarged = 10.0;

// As one looks at a striper from above: forward is up, left is left.
Vector from_above(const Vector& p_scan) { return {-p_scan.y(), p_scan.x()}; }

struct Bars {
  Vectors from, to;

  void add(const Vector& at, const Vector& half) {
    from.push_back(from_above(at - half));
    to.push_back(from_above(at + half));
  }
};

// Both axes of a corner's error ellipse.
void add_ellipse(const Joint& joint, Bars& bars) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(joint.covariance);
  for (int k = 0; k < 2; ++k) {
    const double sigma = std::sqrt(std::max(axes.eigenvalues()[k], 0.0));
    bars.add(joint.corner_m, kEnlarged * sigma * axes.eigenvectors().col(k));
  }
}

SvgChart scan_chart(const PolarScan& scan, const Segmentation& found) {
  Vectors good, left_out;
  Vector low = Vector::Zero();
  Vector high = Vector::Zero();
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    const Return& r = scan.returns[i];
    if (r.status != ReturnStatus::kOk || !std::isfinite(r.range_m)) continue;
    const bool is_outlier = std::binary_search(found.outliers.begin(), found.outliers.end(), i);
    const Vector at = from_above({r.x_m, r.y_m});
    (is_outlier ? left_out : good).push_back(at);
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  const double margin = 0.05 * (high - low).maxCoeff();
  SvgChart chart("A scan from above", {"to the right (m)", low.x() - margin, high.x() + margin},
                 {"forward (m)", low.y() - margin, high.y() + margin}, true);
  chart.dots("return", "#9db4cc", 1.6, good);
  if (!left_out.empty()) chart.dots("outlier", "#c2410c", 2.0, left_out);
  Bars pieces, ends;
  Vectors corners;
  for (const Piece& piece : found.pieces) {
    pieces.from.push_back(from_above(piece.begin_m));
    pieces.to.push_back(from_above(piece.end_m));
    ends.add(piece.begin_m, kEnlarged * piece.sigma_begin_m * piece.line.direction());
    ends.add(piece.end_m, kEnlarged * piece.sigma_end_m * piece.line.direction());
  }
  chart.bars("straight piece", "#12395c", pieces.from, pieces.to);
  Bars ellipses;
  for (const Joint& joint : found.joints) {
    if (joint.kind != JointKind::kCorner) continue;
    corners.push_back(from_above(joint.corner_m));
    add_ellipse(joint, ellipses);
  }
  chart.bars("its ends, ten sigma", "#f0a030", ends.from, ends.to);
  chart.bars("corner, ten sigma", "#15803d", ellipses.from, ellipses.to);
  chart.dots("corner", "#15803d", 2.4, corners);
  return chart;
}

}  // namespace

void MeasurePlot::add(const PolarScan& scan, const StriperModel* model) {
  if (has_scan_) return;
  has_scan_ = true;
  scan_ = scan;
  Segmenter(options_for(model, scan.laser)).segment(scan_, pieces_);
}

void MeasurePlot::add(const Measurement& m, std::uint64_t frame) {
  if (m.status != MeasureStatus::kOk) return;
  Series& series = series_[m.tool];
  series.unit = m.unit;
  if (series.values.size() < kMostValues)
    series.values.push_back({static_cast<double>(frame), m.value, m.sigma});
}

std::string MeasurePlot::svg() const {
  std::vector<SvgChart> charts{scan_chart(scan_, pieces_)};
  for (const auto& [name, series] : series_) {
    if (charts.size() > kMostCharts) break;
    // Beside the first value, since an axis shows few digits.
    const double first = series.values.front().value;
    double reach = 0.0;
    Vectors values;
    Vectors from, to;
    for (const Value& v : series.values) {
      const double beside = v.value - first;
      reach = std::max(reach, std::abs(beside) + 2.0 * v.sigma);
      values.emplace_back(v.frame, beside);
      from.emplace_back(v.frame, beside - v.sigma);
      to.emplace_back(v.frame, beside + v.sigma);
    }
    SvgChart chart(fmt::format("{} beside {:.9g} {}", name, first, series.unit),
                   {"frame", series.values.front().frame - 0.5, series.values.back().frame + 0.5},
                   {series.unit, -reach, reach});
    chart.bars("one sigma", "#f0a030", from, to);
    chart.dots("measured", "#12395c", 2.0, values);
    charts.push_back(chart);
  }
  return svg_of(charts);
}

}  // namespace striper::program
