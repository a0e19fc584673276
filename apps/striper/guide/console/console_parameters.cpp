// SPDX-License-Identifier: Apache-2.0
#include "guide/console/console_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>

namespace striper::program {
namespace {

// A calibration changes the odometer by tyres and their pressure, not by more than this: a decimal
// point of the distance was forgotten then, or the end of the drive.
constexpr double kMostChange = 2.0;

Refusal out_of_range(std::string_view what, double value, std::string_view range) {
  return fmt::format("{} {:g} is out of range: {}", what, value, range);
}

bool is_within(double value, double least, double most) { return value >= least && value <= most; }

}  // namespace

// What the whole file would not allow is refused with its own words.
Refusal ConsoleParameters::take(GuidanceConfig changed) {
  try {
    changed.validate();
  } catch (const Error& error) {
    return error.what();
  }
  config_ = std::move(changed);
  return {};
}

Refusal ConsoleParameters::follow(FollowLine line) {
  GuidanceConfig changed = config_;
  changed.stripe.follow = line;
  return take(std::move(changed));
}

Refusal ConsoleParameters::set_odometer(double counts_per_ft) {
  const bool is_good = is_within(std::abs(counts_per_ft), 0.1, 10000.0);
  if (!is_good) return out_of_range("odometer CF", counts_per_ft, "0.1 to 10000 clks/ft");
  GuidanceConfig changed = config_;
  changed.odometer.counts_per_m = counts_per_ft / kFoot_m;
  return take(std::move(changed));
}

Refusal ConsoleParameters::calibrate_odometer(std::int64_t counts, double distance_ft) {
  if (!is_within(distance_ft, 1.0, 52800.0)) {
    return out_of_range("distance", distance_ft, "1 to 52800 ft");
  }
  if (counts == 0) return "the odometer did not count: nothing was driven, or it is not connected";
  const double new_cf = static_cast<double>(counts) / distance_ft;
  const double ratio = std::abs(new_cf / counts_per_ft());
  if (!is_within(ratio, 1.0 / kMostChange, kMostChange)) {
    return fmt::format(
        "that is {:.3f} clks/ft, where it was {:.3f}: is the distance right? Set it "
        "by hand if it is",
        new_cf, counts_per_ft());
  }
  return set_odometer(new_cf);
}

Refusal ConsoleParameters::set_window(double size) {
  const bool is_good = has_fan() ? is_within(size, 1.0, 90.0) : is_within(size, 0.3, 60.0);
  if (!is_good) {
    return out_of_range("window size", size, has_fan() ? "1 to 90 degrees" : "0.3 to 60 ft");
  }
  const double share = has_fan() ? std::tan(0.5 * size * kDegree) / std::tan(0.5 * first().fan_rad)
                                 : size / window_ft();
  GuidanceConfig changed = config_;
  for (GuidanceBeam& beam : changed.beams) {
    const double middle_m = 0.5 * (beam.y_left_m + beam.y_right_m);
    const double half_m = 0.5 * share * (beam.y_left_m - beam.y_right_m);
    beam.y_left_m = middle_m + half_m;
    beam.y_right_m = middle_m - half_m;
    if (beam.fan_rad <= 0.0) continue;
    const double fan_rad = 2.0 * std::atan(share * std::tan(0.5 * beam.fan_rad));
    // The mirror turns on as fast; a whole turn of a facet is the most it has.
    beam.sweep_s = std::min(beam.sweep_s * fan_rad / beam.fan_rad, 1.0 / beam.rate_hz);
    beam.fan_rad = fan_rad;
  }
  return take(std::move(changed));
}

Refusal ConsoleParameters::set_points(double points) {
  if (!is_within(points, 16.0, 4096.0) || points != std::floor(points)) {
    return out_of_range("points/scan", points, "a whole number, 16 to 4096");
  }
  GuidanceConfig changed = config_;
  for (GuidanceBeam& beam : changed.beams) beam.samples = static_cast<int>(points);
  return take(std::move(changed));
}

Refusal ConsoleParameters::set_stripe_width(double points) {
  const double most = std::floor(0.45 * first().samples);
  if (!is_within(points, 2.0, most)) {
    return out_of_range("stripe width", points, fmt::format("2 to {:g} pts", most));
  }
  GuidanceConfig changed = config_;
  changed.stripe.width_m = points * first().sample_m();
  return take(std::move(changed));
}

Refusal ConsoleParameters::set_threshold(std::size_t beam, double threshold) {
  const double most = full_scale(beam);
  if (!std::isnan(threshold) && !is_within(threshold, 1.0, most)) {
    return out_of_range("threshold", threshold, fmt::format("1 to {:g}", most));
  }
  GuidanceConfig changed = config_;
  changed.beams[beam].threshold = threshold;
  return take(std::move(changed));
}

double ConsoleParameters::window_ft() const noexcept {
  return (first().y_left_m - first().y_right_m) / kFoot_m;
}
double ConsoleParameters::window() const noexcept {
  return has_fan() ? first().fan_rad / kDegree : window_ft();
}
double ConsoleParameters::stripe_points() const noexcept {
  return config_.stripe.width_m / first().sample_m();
}
double ConsoleParameters::counts_per_ft() const noexcept {
  return config_.odometer.counts_per_m * kFoot_m;
}
double ConsoleParameters::full_scale(std::size_t beam) const noexcept {
  return std::ldexp(1.0, config_.beams[beam].bits) - 1.0;
}

std::string ConsoleParameters::threshold_text(std::size_t beam) const {
  const double threshold = config_.beams[beam].threshold;
  return std::isnan(threshold) ? std::string("auto") : fmt::format("{:.0f}", threshold);
}

std::vector<std::string> ConsoleParameters::lines() const {
  const auto line_word = [&] {
    switch (config_.stripe.follow) {
      case FollowLine::kLeft:
        return "using LEFT";
      case FollowLine::kRight:
        return "using RIGHT";
      case FollowLine::kSingle:
        break;
    }
    return "none";
  };
  std::vector<std::string> lines{
      fmt::format("Double line: {}", line_word()),
      fmt::format("Odometer CF: {:.2f} clks/ft", counts_per_ft()),
      fmt::format("Scan frequ.: {:g} Hz", first().rate_hz),
      has_fan() ? fmt::format("Window size: {:.1f}' ~ {:.1f}ft", window(), window_ft())
                : fmt::format("Window size: {:.1f}ft", window_ft()),
      fmt::format("Points/scan: {}", first().samples),
      fmt::format("Stripe width {:.0f}pts ~ {:.1f}in", stripe_points(),
                  config_.stripe.width_m / kInch_m),
      "Threshold values:"};
  for (std::size_t i = 0; i < config_.beams.size(); ++i) {
    lines.push_back(fmt::format(" {:10.10}: {}", config_.beams[i].name, threshold_text(i)));
  }
  return lines;
}

}  // namespace striper::program
