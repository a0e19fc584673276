// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <striper/geometry/line_fit.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/pipeline/expect_stripe.hpp>

namespace striper {
namespace {

// Pixels between the rays that are tried, along and across the stripe, and what is added to what
// they show: as far as one is from the next, and a stripe's own width.
constexpr int kStepAlong = 8;
constexpr int kStepAcross = 4;
constexpr float kMargin = 8.0F;

// Beyond the depth that was calibrated a stripe is still looked for: from half the nearest range to
// three times the farthest, where a range, whose error goes with its square, is known nine times
// worse.
constexpr double kNearer = 0.5;
constexpr double kFarther = 3.0;
// Widths of ranges that lie at about one place say nothing of a slope: the sum of the squares of
// their distances from the middle, pixels squared.
constexpr double kLeastLever_px2 = 4.0;

struct RangeLimits {
  double first_m = 0.0;
  double last_m = std::numeric_limits<double>::infinity();
};

RangeLimits limits_of(const StripeLook& look, const ScanOptions& asked) {
  RangeLimits range{asked.min_range_m, asked.max_range_m};
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0.0;
  const auto saw = [&](double range_m) {
    nearest = std::min(nearest, range_m);
    farthest = std::max(farthest, range_m);
  };
  for (const StripeLook::WidthAt& w : look.width_at) saw(w.range_m);
  for (const StripeLook::AmplitudeAt& a : look.amplitude_at) saw(a.range_m);
  if (!(farthest > 0.0)) return range;
  if (!(asked.min_range_m > 0.0)) range.first_m = std::min(kNearer * nearest, range.last_m);
  if (std::isinf(asked.max_range_m)) {
    range.last_m = std::max(kFarther * farthest, range.first_m);
  }
  return range;
}

struct Sensor {
  bool is_columns;
  int lines;   // Columns or rows,
  int length;  // and pixels across.

  Eigen::Vector2d pixel(double along, double across) const {
    return is_columns ? Eigen::Vector2d(along, across) : Eigen::Vector2d(across, along);
  }
};

// The first and last pixel of a scan line that can show the stripe; first above last: none.
struct Span {
  float first;
  float last;
};

Span span_of(const Triangulator& triangulator, const Sensor& sensor, double along,
             const RangeLimits& range) {
  Span span{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (int across = 0; across < sensor.length + kStepAcross; across += kStepAcross) {
    const double at = std::min(across, sensor.length - 1);
    const PlanePoint point = triangulator.triangulate(sensor.pixel(along, at));
    if (point.status != ReturnStatus::kOk) continue;
    const double range_m = point.range_m();
    if (range_m < range.first_m || range_m > range.last_m) continue;
    span.first = std::min(span.first, static_cast<float>(at) - kMargin);
    span.last = std::max(span.last, static_cast<float>(at) + kMargin);
  }
  return span;
}

void find_spans(const Triangulator& triangulator, const Sensor& sensor, const RangeLimits& range,
                ExpectedStripe& expected) {
  std::vector<Span> nodes;
  for (int line = 0; line < sensor.lines + kStepAlong; line += kStepAlong) {
    nodes.push_back(span_of(triangulator, sensor, std::min(line, sensor.lines - 1), range));
  }
  // Between two scan lines that were tried, whatever one of them shows.
  for (int line = 0; line < sensor.lines; ++line) {
    const auto node = static_cast<std::size_t>(line / kStepAlong);
    const std::size_t next = std::min(node + 1, nodes.size() - 1);
    expected.first_px.push_back(std::min(nodes[node].first, nodes[next].first));
    expected.last_px.push_back(std::max(nodes[node].last, nodes[next].last));
  }
}

// A straight line through the widths over the pixels that show their ranges.
void find_width(const Triangulator& triangulator, const Sensor& sensor, const StripeLook& look,
                ExpectedStripe& expected) {
  expected.sigma_px = look.width_px;
  LineSums widths;
  for (const StripeLook::WidthAt& width : look.width_at) {
    const Projection pixel = triangulator.project(width.range_m, 0.0);
    if (pixel.status != CameraStatus::kOk) continue;
    const double across = sensor.is_columns ? pixel.pixel.y() : pixel.pixel.x();
    if (!(across >= 0.0 && across <= sensor.length - 1)) continue;
    widths.add(1.0, across, width.width_px, 1.0);
  }
  if (widths.points == 0) return;
  expected.pivot_px = widths.fg / widths.ff;
  expected.sigma_px = widths.fz / widths.ff;
  if (widths.determinant() / widths.ff > kLeastLever_px2)
    expected.sigma_slope = widths.solve().parameters[1];
}

// Between two ranges as powers of the range; beyond them as the nearest one.
double amplitude_at(const std::vector<StripeLook::AmplitudeAt>& table, double range_m) {
  if (range_m <= table.front().range_m) return table.front().amplitude_dn;
  for (std::size_t i = 1; i < table.size(); ++i) {
    const StripeLook::AmplitudeAt& a = table[i - 1];
    const StripeLook::AmplitudeAt& b = table[i];
    if (range_m > b.range_m) continue;
    const double part = std::log(range_m / a.range_m) / std::log(b.range_m / a.range_m);
    return a.amplitude_dn * std::pow(b.amplitude_dn / a.amplitude_dn, part);
  }
  return table.back().amplitude_dn;
}

// In the middle scan line: its range is nearly that of the others in the same row.
void find_amplitudes(const Triangulator& triangulator, const Sensor& sensor, const StripeLook& look,
                     ExpectedStripe& expected) {
  if (look.amplitude_at.empty()) return;
  expected.amplitude_dn.assign(static_cast<std::size_t>(sensor.length), 0.0F);
  for (int across = 0; across < sensor.length; ++across) {
    const PlanePoint point = triangulator.triangulate(sensor.pixel(0.5 * sensor.lines, across));
    if (point.status != ReturnStatus::kOk) continue;
    expected.amplitude_dn[static_cast<std::size_t>(across)] =
        static_cast<float>(amplitude_at(look.amplitude_at, point.range_m()));
  }
}

}  // namespace

ExpectedStripe expect_stripe(const StriperModel& model, int laser, const ScanOptions& limits) {
  const Triangulator triangulator(model, laser);
  const StripeLook& look = model.lasers[static_cast<std::size_t>(laser)].look;
  const bool is_columns = model.axis == StripeAxis::kColumns;
  const int width = model.camera.width();
  const int height = model.camera.height();
  const Sensor sensor{is_columns, is_columns ? width : height, is_columns ? height : width};
  ExpectedStripe expected;
  find_spans(triangulator, sensor, limits_of(look, limits), expected);
  find_width(triangulator, sensor, look, expected);
  find_amplitudes(triangulator, sensor, look, expected);
  return expected;
}

}  // namespace striper
