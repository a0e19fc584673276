// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/guidance/guidance_config.hpp>

namespace striper {
namespace {

constexpr std::array<std::string_view, kGuidanceFaults> kFaultWords{
    "no_stripe", "beam_silent", "beam_blind", "odometer",
    "mirror",    "laser_off",   "time",       "queue_full"};
constexpr std::array<std::string_view, 3> kActionWords{"stop", "hold", "warn"};

bool is_within(double value, double least, double most) { return value >= least && value <= most; }

void validate_beam(const GuidanceBeam& beam) {
  const std::string name = "beam '" + beam.name + "': ";
  if (beam.name.empty()) throw Error(ErrorKind::kBadValue, "a beam has no name");
  require_value(is_within(beam.x_m, -50.0, 50.0), name + "x_m", beam.x_m, "-50 to 50 m");
  require_value(is_within(beam.y_left_m, -20.0, 20.0), name + "y_left_m", beam.y_left_m,
                "-20 to 20 m");
  require_value(beam.y_right_m >= -20.0 && beam.y_right_m < beam.y_left_m, name + "y_right_m",
                beam.y_right_m, "less than y_left_m, -20 m or more");
  require_value(is_within(beam.fan_rad, 0.0, 2.0), name + "fan_deg", beam.fan_rad / kDegree,
                "0 (equal steps) to 114 degrees");
  require_value(is_within(beam.rate_hz, 0.1, 1e5), name + "rate_hz", beam.rate_hz, "0.1 to 100000");
  require_value(is_within(beam.sweep_s, 0.0, 1.0 / beam.rate_hz), name + "sweep_s", beam.sweep_s,
                "0 to 1 / rate_hz");
  require_value(is_within(beam.samples, 8, 65536), name + "samples", beam.samples, "8 to 65536");
  require_value(is_within(beam.bits, 1, 24), name + "bits", beam.bits, "1 to 24");
  require_value(is_within(beam.zero_m, -1.0, 1.0), name + "zero_m", beam.zero_m, "-1 to 1 m");
  require_value(is_within(beam.scale, 0.5, 2.0), name + "scale", beam.scale, "0.5 to 2");
  require_value(is_within(beam.height_m, 0.05, 20.0), name + "height_m", beam.height_m,
                "0.05 to 20 m");
  require_value(std::isnan(beam.threshold) ||
                    is_within(beam.threshold, 1.0, std::ldexp(1.0, beam.bits) - 1.0),
                name + "threshold", beam.threshold, "1 to 2^bits - 1, or none: automatic");
  for (const double gain : beam.response) {
    require_value(is_within(gain, 1e-3, 1e3), name + "response", gain, "gains of .001 to 1000");
  }
}

void validate_gun(const std::string& name, const PaintGunOptions& gun) {
  try {
    gun.validate();
  } catch (const Error& error) {
    throw Error(error.kind(), fmt::format("gun '{}': {}", name, error.what()));
  }
}

// A covariance: as many rows as parameters, alike across its diagonal, no variance below zero.
void validate_alignment(const std::vector<double>& covariance, std::size_t parameters) {
  if (covariance.empty()) return;
  if (covariance.size() != parameters * parameters) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("alignment: covariance has {} numbers; expected {}", covariance.size(),
                            parameters * parameters));
  }
  for (std::size_t i = 0; i < parameters; ++i) {
    require_value(covariance[i * parameters + i] >= 0.0, "alignment: covariance: a variance",
                  covariance[i * parameters + i], "0 or more");
    for (std::size_t k = 0; k < i; ++k) {
      const double one = covariance[i * parameters + k];
      const double other = covariance[k * parameters + i];
      const double most =
          std::sqrt(covariance[i * parameters + i] * covariance[k * parameters + k]);
      require_value(
          std::abs(one - other) <= 1e-9 * most + 1e-300 && std::abs(one) <= 1.000001 * most,
          "alignment: covariance", one, "alike across the diagonal, within the variances");
    }
  }
}

}  // namespace

std::string_view to_string(GuidanceFault fault) noexcept {
  return kFaultWords[static_cast<std::size_t>(fault)];
}
std::string_view to_string(FaultAction action) noexcept {
  return kActionWords[static_cast<std::size_t>(action)];
}

double GuidanceBeam::window_m(double index) const noexcept {
  const double middle_m = 0.5 * (y_left_m + y_right_m);
  const double half_m = 0.5 * (y_left_m - y_right_m);
  const double side = 1.0 - 2.0 * index / (samples - 1);
  if (fan_rad <= 0.0) return middle_m + half_m * side;
  const double phi = 0.5 * fan_rad;
  return middle_m + half_m * std::tan(phi * side) / std::tan(phi);
}

double GuidanceBeam::delay_s(double index) const noexcept {
  return index * sweep_s / (samples - 1);
}

double GuidanceBeam::sample_m() const noexcept {
  return scale * (y_left_m - y_right_m) / (samples - 1);
}

double GuidanceOutput::volts(double lateral_m) const noexcept {
  if (!std::isfinite(lateral_m)) return volts_safe;
  return std::clamp(volts_per_m * (lateral_m - offset_m), volts_min, volts_max);
}

PaintGunOptions GuidanceConfig::gun_options(const GuidanceGun& gun) const {
  PaintGunOptions options = gun.gun;
  options.end_extension_m = stripe.end_extension_m;
  options.dash_min_m = stripe.dash_min_m;
  options.gap_min_m = stripe.gap_min_m;
  return options;
}

void GuidanceConfig::validate() const {
  if (beams.empty() || beams.size() > 8) {
    throw Error(ErrorKind::kBadValue, fmt::format("{} beams; expected 1 to 8", beams.size()));
  }
  std::set<std::string> names;
  std::set<double> places;
  for (const GuidanceBeam& beam : beams) {
    validate_beam(beam);
    if (!names.insert(beam.name).second) {
      throw Error(ErrorKind::kBadValue, fmt::format("two beams are called '{}'", beam.name));
    }
    if (beam.use != BeamUse::kOff && !places.insert(beam.x_m).second) {
      throw Error(ErrorKind::kBadValue, fmt::format("two beams are at x_m {}", beam.x_m));
    }
  }
  if (places.empty()) throw Error(ErrorKind::kBadValue, "every beam is off");
  odometer.validate();
  for (const GuidanceGun& gun : guns) {
    validate_gun(gun.name, gun_options(gun));
    require_value(gun.line == 0 || gun.line == 1, "gun '" + gun.name + "': line", gun.line,
                  "0 or 1");
  }
  require_value(is_within(stripe.width_m, 0.01, 1.0), "stripe: width_m", stripe.width_m,
                "0.01 to 1 m");
  require_value(is_within(stripe.spacing_m, 0.0, 2.0), "stripe: spacing_m", stripe.spacing_m,
                "0 to 2 m");
  require_value(is_within(stripe.gap_limit_m, 0.1, 1e4), "stripe: gap_limit_m", stripe.gap_limit_m,
                "0.1 to 10000 m");
  require_value(is_within(stripe.marker_max_m, 0.0, 2.0), "stripe: marker_max_m",
                stripe.marker_max_m, "0 to 2 m");
  require_value(!stripe.lines.empty() && stripe.lines.size() <= 2, "stripe: lines",
                static_cast<double>(stripe.lines.size()), "1 or 2");
  require_value(is_within(smoothing.alpha, 0.0, 0.999), "smoothing: alpha", smoothing.alpha,
                "0 to 0.999");
  require_value(output.volts_min < output.volts_max, "output: volts_min", output.volts_min,
                "less than volts_max");
  require_value(is_within(output.volts_safe, output.volts_min, output.volts_max),
                "output: volts_safe", output.volts_safe, "within volts_min and volts_max");
  require_value(is_within(output.offset_sd_m, 0.0, 1.0), "output: offset_sd_m", output.offset_sd_m,
                "0 to 1 m");
  validate_alignment(alignment_covariance, 2 * beams.size());
  require_value(std::isfinite(output.volts_per_m) && output.volts_per_m != 0.0,
                "output: volts_per_m", output.volts_per_m, "a number, not 0");
}

GuidanceConfig report_truck() {
  GuidanceConfig truck;
  // 10.8 degrees of the mirror at 22 turns a second; 312.5 kHz for three beams.
  constexpr double kWindow_s = 10.8 / 360.0 / 22.0;
  struct Place {
    const char* name;
    double x_m;
    double half_m;
  };
  constexpr std::array kPlaces{Place{"front", 8 * kFoot_m, 1.5 * kFoot_m},
                               Place{"middle", 5 * kFoot_m, 0.95 * kFoot_m},
                               Place{"rear", -8 * kFoot_m, 1.5 * kFoot_m}};
  for (const Place& place : kPlaces) {
    GuidanceBeam beam;
    beam.name = place.name;
    beam.x_m = place.x_m;
    beam.y_left_m = place.half_m;
    beam.y_right_m = -place.half_m;
    beam.height_m = 34 * kInch_m;
    beam.fan_rad = 21.6 * kDegree;
    beam.sweep_s = kWindow_s;
    beam.threshold = 1000.0;
    truck.beams.push_back(beam);
  }
  truck.odometer.counts_per_m = 11.725 / kFoot_m;
  truck.odometer.bits = 32;
  truck.guns.emplace_back();
  return truck;
}

}  // namespace striper
