// SPDX-License-Identifier: Apache-2.0
#include "measure/verify_sheet.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/robust.hpp>
#include <striper/geometry/line_fit.hpp>
#include <striper/geometry/triangulator.hpp>

namespace striper::program {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// Beyond, a striper tells that something is there rather than where.
constexpr double kMostStep = 0.1;
constexpr int kFewestScans = 5;  // For a deviation.

nlohmann::json number(double value) {
  if (!std::isfinite(value)) return nullptr;
  return value;
}

// The pixel `across` the stripe on the line at `along`.
Eigen::Vector2d pixel(const StriperModel& model, double along, double across) {
  return model.axis == StripeAxis::kColumns ? Eigen::Vector2d(along, across)
                                            : Eigen::Vector2d(across, along);
}

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return kNan;
  const auto at =
      static_cast<std::size_t>(std::lround(part * static_cast<double>(values.size() - 1)));
  return nth_smallest(values, at);
}

double deviation(const std::vector<double>& values) {
  if (static_cast<int>(values.size()) < kFewestScans) return kNan;
  double mean = 0.0;
  double squares = 0.0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

}  // namespace

MeasuringRange measuring_range(const StriperModel& model, int laser) {
  const Triangulator triangulator(model, laser);
  const bool is_columns = model.axis == StripeAxis::kColumns;
  const int lines = is_columns ? model.camera.width() : model.camera.height();
  const int size = is_columns ? model.camera.height() : model.camera.width();
  const auto point = [&](double along, double across) {
    return triangulator.triangulate(pixel(model, along, across));
  };
  const auto width = [&](int across) {
    const PlanePoint a = point(0, across);
    const PlanePoint b = point(lines - 1, across);
    return std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
  };
  MeasuringRange range{kNan, kNan, kNan, kNan};
  for (int across = 0; across < size; ++across) {
    const double here = point(0.5 * (lines - 1), across).range_m();
    const double before = point(0.5 * (lines - 1), across - 0.5).range_m();
    const double next = point(0.5 * (lines - 1), across + 0.5).range_m();
    if (!(std::max(std::abs(next - here), std::abs(before - here)) <= kMostStep * here)) continue;
    if (!(here >= range.clearance_m)) {
      range.clearance_m = here;
      range.width_near_m = width(across);
    }
    if (here <= range.far_m) continue;
    range.far_m = here;
    range.width_far_m = width(across);
  }
  return range;
}

Linearity linearity(const std::vector<KnownDistance>& distances) {
  LineSums sums;
  for (const KnownDistance& one : distances) sums.add(1.0, one.known_m, one.measured_m, 1.0);
  const LineFit fit = sums.solve();
  Linearity found;
  if (!fit.is_determined) return {kNan, kNan, kNan};
  found.offset_m = fit.parameters[0];
  found.gain = fit.parameters[1];
  for (const KnownDistance& one : distances)
    found.most_m = std::max(found.most_m, std::abs(one.measured_m - fit.at(1.0, one.known_m)));
  return found;
}

void VerifySheet::add(const PolarScan& scan) {
  places_.resize(std::max(places_.size(), scan.returns.size()));
  const Return* last = nullptr;
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    const Return& r = scan.returns[i];
    const bool is_good = r.status == ReturnStatus::kOk && std::isfinite(r.range_m);
    if (is_good) {
      Place& place = places_[i];
      if (place.count++ == 0) place.first = r.range_m;
      place.sum += r.range_m - place.first;
      place.squares += (r.range_m - place.first) * (r.range_m - place.first);
      if (last != nullptr) spacings_m_.push_back(std::hypot(r.x_m - last->x_m, r.y_m - last->y_m));
    }
    last = is_good ? &r : nullptr;
  }
}

std::vector<double> VerifySheet::deviations_m() const {
  std::vector<double> deviations;
  for (const Place& place : places_) {
    if (place.count < kFewestScans) continue;
    const double n = place.count;
    deviations.push_back(
        std::sqrt(std::max(place.squares - place.sum * place.sum / n, 0.0) / (n - 1.0)));
  }
  return deviations;
}

nlohmann::json VerifySheet::to_json(const MeasuringRange& range, double rate_hz,
                                    const std::vector<double>& distances_m) const {
  const std::vector<double> deviations = deviations_m();
  return {{"clearance_m", number(range.clearance_m)},
          {"measuring_range_m", number(range.far_m - range.clearance_m)},
          {"far_m", number(range.far_m)},
          {"width_near_m", number(range.width_near_m)},
          {"width_far_m", number(range.width_far_m)},
          {"x_spacing_m", number(quantile(spacings_m_, 0.5))},
          {"x_spacing_count", spacings_m_.size()},
          {"z_resolution_m", number(quantile(deviations, 0.5))},
          {"z_resolution_95_m", number(quantile(deviations, 0.95))},
          {"z_resolution_count", deviations.size()},
          {"repeatability_of_mean_m", number(deviation(distances_m))},
          {"repeatability_count", distances_m.size()},
          {"rate_hz", number(rate_hz)},
          {"latency_s", number(quantile(seconds_, 0.5))},
          {"latency_95_s", number(quantile(seconds_, 0.95))},
          {"latency_count", seconds_.size()}};
}

std::vector<std::string> sheet_lines(const nlohmann::json& sheet) {
  std::vector<std::string> lines;
  const auto text = [&](const char* name, double unit, const char* format) {
    const nlohmann::json& value = sheet.at(name);
    return value.is_null() ? std::string("-")
                           : fmt::format(fmt::runtime(format), value.get<double>() * unit);
  };
  const auto count = [&](const char* name) { return sheet.at(name).get<std::size_t>(); };
  lines.push_back(
      fmt::format("clearance {} m, measuring range {} m (to where half a pixel is a "
                  "tenth of the range)",
                  text("clearance_m", 1, "{:.3f}"), text("measuring_range_m", 1, "{:.3f}")));
  lines.push_back(fmt::format("field of view {} m near, {} m far",
                              text("width_near_m", 1, "{:.3f}"), text("width_far_m", 1, "{:.3f}")));
  lines.push_back(fmt::format("spacing {} mm (median of {})", text("x_spacing_m", 1e3, "{:.3f}"),
                              count("x_spacing_count")));
  lines.push_back(
      fmt::format("z resolution {} mm median, {} mm 95 % (k = 2: twice the temporal "
                  "deviation of a point; {} points)",
                  text("z_resolution_m", 2e3, "{:.4f}"), text("z_resolution_95_m", 2e3, "{:.4f}"),
                  count("z_resolution_count")));
  lines.push_back(fmt::format("repeatability of the mean {} mm (k = 2; {} scans)",
                              text("repeatability_of_mean_m", 2e3, "{:.4f}"),
                              count("repeatability_count")));
  lines.push_back(fmt::format("rate {} frames/s; latency {} ms median, {} ms 95 % ({} frames)",
                              text("rate_hz", 1, "{:.1f}"), text("latency_s", 1e3, "{:.2f}"),
                              text("latency_95_s", 1e3, "{:.2f}"), count("latency_count")));
  return lines;
}

}  // namespace striper::program
