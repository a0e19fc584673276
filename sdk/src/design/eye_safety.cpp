// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <striper/design/eye_safety.hpp>

#include "design/ansi_z136.hpp"
#include "design/emission_checks.hpp"

namespace striper {
namespace {

using detail::Measurement;

bool has_smaller_limit(const EmissionCheck& a, const EmissionCheck& b) {
  return a.largest < b.largest;
}

// What is emitted over the strictest limit of a class in one condition.
double fraction(const EyeSafetyInput& input, EmissionLimit limit, const Measurement& at) {
  const std::vector<EmissionCheck> checks = detail::checks_of(input, limit, at);
  const auto strictest = std::min_element(checks.begin(), checks.end(), has_smaller_limit);
  return detail::emitted(input) / strictest->largest;
}

bool is_within(const EyeSafetyInput& input, EmissionLimit limit) {
  const std::vector<Measurement> at = detail::measurements(input);
  return std::all_of(at.begin(), at.end(),
                     [&](const Measurement& one) { return fraction(input, limit, one) <= 1.0; });
}

// Of the M classes: the bare eye within the class, the telescope within 3B.
bool is_within_unaided(const EyeSafetyInput& input, EmissionLimit limit) {
  const std::vector<Measurement> at = detail::measurements(input);
  return fraction(input, limit, at.back()) <= 1.0 &&
         fraction(input, EmissionLimit::kClass3B, at.front()) <= 1.0;
}

LaserClass class_of(const EyeSafetyInput& input) {
  if (is_within(input, EmissionLimit::kClass1)) return LaserClass::k1;
  if (is_within_unaided(input, EmissionLimit::kClass1)) return LaserClass::k1M;
  if (is_visible(input.wavelength_nm)) {
    if (is_within(input, EmissionLimit::kClass2)) return LaserClass::k2;
    if (is_within_unaided(input, EmissionLimit::kClass2)) return LaserClass::k2M;
  }
  if (is_within(input, EmissionLimit::kClass3R)) return LaserClass::k3R;
  return is_within(input, EmissionLimit::kClass3B) ? LaserClass::k3B : LaserClass::k4;
}

// The nearest approach from which on a laser is within its limit; what comes through an aperture
// never grows with the distance. NaN where it stays above it even at kFarthest_m.
template <typename Fraction>
double closest_approach_m(EyeSafetyInput input, Fraction fraction_of) {
  constexpr double kFarthest_m = 1e4;
  const auto is_safe_at = [&](double distance_m) {
    input.closest_m = distance_m;
    return fraction_of(input) <= 1.0;
  };
  if (is_safe_at(0.0)) return 0.0;
  double near_m = 0.0;
  double far_m = 0.1;
  while (!is_safe_at(far_m)) {
    near_m = far_m;
    far_m *= 2.0;
    if (far_m > kFarthest_m) return EyeSafetyReport::kNone;
  }
  for (int n = 0; n < 50; ++n) {
    const double middle_m = 0.5 * (near_m + far_m);
    (is_safe_at(middle_m) ? far_m : near_m) = middle_m;
  }
  return far_m;
}

double class_1_fraction(const EyeSafetyInput& input, bool with_telescope) {
  const std::vector<Measurement> at = detail::measurements(input);
  const double bare = fraction(input, EmissionLimit::kClass1, at.back());
  return with_telescope ? std::max(bare, fraction(input, EmissionLimit::kClass1, at.front()))
                        : bare;
}

void add_closest(const EyeSafetyInput& input, EyeSafetyReport& report) {
  report.closest_safe_m = closest_approach_m(
      input, [](const EyeSafetyInput& at) { return class_1_fraction(at, true); });
  report.closest_unaided_m = closest_approach_m(
      input, [](const EyeSafetyInput& at) { return class_1_fraction(at, false); });
}

void add_largest(const EyeSafetyInput& input, EyeSafetyReport& report) {
  if (const auto* pulses = std::get_if<PulsedEmission>(&input.emission)) {
    report.max_energy_j = report.limiting.largest;
    report.max_power_w = report.limiting.largest * pulses->rate_hz;
  } else {
    report.max_power_w = report.limiting.largest;
  }
}

void add_factors(const EyeSafetyInput& input, EyeSafetyReport& report) {
  const double nm = input.wavelength_nm;
  if (nm < 600.0) report.steps.push_back({"C3", c3(nm), ""});
  report.steps.push_back({"C4", c4(nm), ""});
  report.steps.push_back({"T2", t2_s(input.source_mrad), "s"});
  if (const auto* pulses = std::get_if<PulsedEmission>(&input.emission)) {
    const double base_s = time_base_s(EmissionLimit::kClass1, nm);
    const double count = std::max(1.0, pulses->rate_hz * std::min(base_s, t2_s(input.source_mrad)));
    report.steps.push_back({"pulses", count, ""});
    report.steps.push_back({"C5", c5(pulses->pulse_s, count, input.source_mrad, base_s), ""});
    report.steps.push_back({"C6", c6(input.source_mrad, pulses->pulse_s), ""});
  } else {
    report.steps.push_back({"C6", c6(input.source_mrad, 100.0), ""});
  }
}

void add_checks(const EyeSafetyInput& input, EyeSafetyReport& report) {
  for (const Measurement& at : detail::measurements(input)) {
    const double share = aperture_share(input.beam, at.aperture_m, at.distance_m);
    report.steps.push_back(
        {fmt::format("condition {} distance", at.condition), at.distance_m, "m"});
    report.steps.push_back({fmt::format("condition {} share", at.condition), share, ""});
    for (EmissionCheck& check : detail::checks_of(input, EmissionLimit::kClass1, at)) {
      const std::string name = fmt::format("condition {} {}", at.condition, check.rule);
      report.steps.push_back({name + " AEL", check.ael, check.unit});
      const bool is_pulsed = std::holds_alternative<PulsedEmission>(input.emission);
      report.steps.push_back({name + " emitted", check.largest, is_pulsed ? "J" : "W"});
      report.checks.push_back(std::move(check));
    }
  }
}

std::vector<std::string> not_checked(const EyeSafetyInput& input) {
  std::vector<std::string> open = {
      // NOLINTNEXTLINE(bugprone-suspicious-missing-comma): one sentence on two lines.
      "The limits come from two public codes that agree and from memory (3R, 3B and photochemical "
      "limits from memory alone), not from the standard's text: check them before relying on them.",
      "Single faults: what the laser emits when its driver, its trigger or its optics fail.",
      "Labels, the housing, interlocks and the other engineering requirements of a class.",
      "Groups of pulses and irregular trains: the pulses are taken as equal and evenly spaced.",
      "That nobody comes nearer than the closest distance given, with a mirror or a lens neither."};
  if (std::holds_alternative<FanBeam>(input.beam))
    open.emplace_back("That fan and thickness are even: a hot spot in the line gives an eye more.");
  if (std::holds_alternative<RoundBeam>(input.beam))
    open.emplace_back("That the beam is Gaussian and its diameter the one that holds 63 %.");
  if (input.source_mrad > kPointSource_mrad)
    open.emplace_back(
        "The apparent source's angle, with the eye focused on every point of the "
        "beam, the fan's vertex among them; and parts of it that are brighter.");
  if (const auto* steady = std::get_if<ContinuousEmission>(&input.emission);
      steady != nullptr && steady->scan_speed_rad_s) {
    open.emplace_back("The safeguard that switches the laser off when the scan fails: how fast.");
    open.emplace_back(
        "That the beam turns all the way round: one that goes to and fro passes an eye more often, "
        "and stands where it turns back.");
  }
  return open;
}

EyeSafetyReport assess_iec(const EyeSafetyInput& input) {
  EyeSafetyReport report;
  add_factors(input, report);
  add_checks(input, report);
  report.limiting =
      *std::min_element(report.checks.begin(), report.checks.end(), has_smaller_limit);
  report.fraction_of_limit = detail::emitted(input) / report.limiting.largest;
  report.laser_class = class_of(input);
  add_largest(input, report);
  add_closest(input, report);
  report.not_checked = not_checked(input);
  return report;
}

}  // namespace

std::string_view to_string(LaserClass laser_class) noexcept {
  switch (laser_class) {
    case LaserClass::k1:
      return "1";
    case LaserClass::k1M:
      return "1M";
    case LaserClass::k2:
      return "2";
    case LaserClass::k2M:
      return "2M";
    case LaserClass::k3R:
      return "3R";
    case LaserClass::k3B:
      return "3B";
    case LaserClass::k4:
      return "4";
    case LaserClass::kAbove1:
      return "above 1";
  }
  return "";
}

EyeSafetyReport assess_eye_safety(const EyeSafetyInput& input) {
  input.validate();
  return input.standard == LaserStandard::kIec2014 ? assess_iec(input)
                                                   : detail::assess_ansi_1993(input);
}

}  // namespace striper
