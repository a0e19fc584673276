// SPDX-License-Identifier: Apache-2.0
#include "guide/console/curve_view.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <striper/core/units.hpp>
#include <striper/guidance/paint_finder.hpp>

namespace striper::program {
namespace {

struct Scale {
  double top = 1.0;  // Of the converter's counts.
  int rows = 1;
  int columns = 1;
  std::size_t samples = 1;

  // From the bottom, 0 up to rows - 1.
  int height(double value) const {
    return std::clamp(static_cast<int>(std::lround(value / top * (rows - 1))), 0, rows - 1);
  }
  int column(double sample) const {
    const double share = sample / static_cast<double>(std::max<std::size_t>(samples - 1, 1));
    return std::clamp(static_cast<int>(std::lround(share * (columns - 1))), 0, columns - 1);
  }
};

// The highest sample of each column.
std::vector<double> columns_of(const BeamSweep& sweep, const Scale& scale) {
  std::vector<double> highest(static_cast<std::size_t>(scale.columns), -1.0);
  for (std::size_t i = 0; i < sweep.samples.size(); ++i) {
    double& column = highest[static_cast<std::size_t>(scale.column(static_cast<double>(i)))];
    column = std::max(column, sweep.samples[i]);
  }
  // Where there are more columns than samples the curve goes on as it was.
  for (std::size_t i = 1; i < highest.size(); ++i) {
    if (highest[i] < 0.0) highest[i] = highest[i - 1];
  }
  return highest;
}

PaintFinderOptions finder_options(const GuidanceBeam& beam, std::size_t samples,
                                  double stripe_width_m) {
  PaintFinderOptions options;
  options.samples = std::max<std::size_t>(samples, 3);
  options.threshold = beam.threshold;
  const double sample_m =
      beam.sample_m() * (beam.samples - 1) / static_cast<double>(options.samples - 1);
  options.width_samples = stripe_width_m / sample_m;
  return options;
}

// A sample of a sweep that may have another number of points than the file says now.
double lateral_m(const GuidanceBeam& beam, double sample, std::size_t samples) {
  return beam.lateral_m(sample * (beam.samples - 1) /
                        static_cast<double>(std::max<std::size_t>(samples - 1, 1)));
}

}  // namespace

void draw_curve(const BeamSweep& sweep, const GuidanceBeam& beam, double stripe_width_m,
                const CurveArea& area, TextCanvas& canvas) {
  if (sweep.samples.empty() || area.rows < 5 || area.columns < 10) return;
  Scale scale;
  scale.rows = area.rows - 3;  // But for the frame and the marks.
  scale.columns = area.columns - 2;
  scale.samples = sweep.samples.size();
  const double highest = *std::max_element(sweep.samples.begin(), sweep.samples.end());
  const double threshold = std::isnan(beam.threshold) ? 0.0 : beam.threshold;
  scale.top = std::max({highest, 1.1 * threshold, 1.0});

  PaintFinder finder(finder_options(beam, sweep.samples.size(), stripe_width_m));
  const auto lines = finder.find(sweep.samples);
  const std::string word =
      std::isnan(beam.threshold) ? std::string("auto") : fmt::format("{:.0f}", beam.threshold);
  std::string title = fmt::format("Beam {}  Threshold={}", beam.name, word);
  title +=
      lines.empty()
          ? std::string("  no line")
          : fmt::format("  at {:+.2f}in",
                        lateral_m(beam, lines.front().centre(), sweep.samples.size()) / kInch_m);
  canvas.box(area.row, area.column, area.rows, area.columns, title);
  const int bottom = area.row + scale.rows;
  if (!std::isnan(beam.threshold)) {
    canvas.put(bottom - scale.height(threshold), area.column + 1,
               std::string(static_cast<std::size_t>(scale.columns), '-'), Look::kThreshold);
  }
  const std::vector<double> curve = columns_of(sweep, scale);
  int before = scale.height(curve.front());
  for (int column = 0; column < scale.columns; ++column) {
    const int height = scale.height(curve[static_cast<std::size_t>(column)]);
    for (int h = std::min(before, height) + 1; h < std::max(before, height); ++h) {
      canvas.put(bottom - h, area.column + 1 + column, "|");
    }
    canvas.put(bottom - height, area.column + 1 + column, "*");
    before = height;
  }
  for (const PaintLine& line : lines) {
    for (const double edge : {line.begin, line.end}) {
      canvas.put(bottom + 1, area.column + 1 + scale.column(edge), "^", Look::kPaint);
    }
    canvas.put(bottom + 1, area.column + 1 + scale.column(line.centre()), "+", Look::kPaint);
  }
}

}  // namespace striper::program
