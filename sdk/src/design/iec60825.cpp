// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <striper/design/iec60825.hpp>

namespace striper {
namespace {

constexpr double kBlinkReflex_s = 0.25;
constexpr double kShortest_s = 1e-11;  // Below, limits do not fall any more with C4.
constexpr double kThermalBegins_s = 10.0;

// One column of limits: constant energy for short pulses, then t^.75, then constant power.
struct Limits {
  double shortest_j;    // Up to 1e-11 s.
  double short_j;       // Up to T_i.
  double t34;           // J / s^.75, up to `power_from_s` (of a point source).
  double power_w;       // From there on.
  double power_from_s;  // T2, or the end of the blink reflex.
};

constexpr Limits kLimits1 = {3.8e-8, 7.7e-8, 7e-4, 3.9e-4, kThermalBegins_s};
constexpr Limits kLimits2 = {3.8e-8, 7.7e-8, 7e-4, 1e-3, kBlinkReflex_s};
constexpr Limits kLimits3RVisible = {1.9e-7, 3.8e-7, 3.5e-3, 5e-3, kBlinkReflex_s};
constexpr Limits kLimits3RInfrared = {1.9e-7, 3.8e-7, 3.5e-3, 2e-3, kThermalBegins_s};

// Where limits go on with t^.75 to T2, an extended source has its own T2 and power.
double extended_limit_j(const Limits& limits, double c4, double seconds, double source_mrad) {
  const double t2 = t2_s(source_mrad);
  const double factor = limits.t34 * c4 * c6(source_mrad, seconds);
  if (seconds < t2) return factor * std::pow(seconds, 0.75);
  return factor * std::pow(t2, -0.25) * seconds;
}

double thermal_limit_j(const Limits& limits, double c4, double seconds, double source_mrad) {
  const double factor6 = c6(source_mrad, seconds);
  if (seconds < kShortest_s) return limits.shortest_j * factor6;
  if (seconds < kThermalConfinement_s) return limits.short_j * c4 * factor6;
  const bool is_extended = source_mrad > kPointSource_mrad;
  if (seconds >= kThermalBegins_s && is_extended && limits.power_from_s == kThermalBegins_s)
    return extended_limit_j(limits, c4, seconds, source_mrad);
  if (seconds < limits.power_from_s) return limits.t34 * c4 * std::pow(seconds, 0.75) * factor6;
  return limits.power_w * c4 * factor6 * seconds;
}

double limit_3b_j(double c4, double seconds) {
  constexpr double kPulse_j = 0.03;
  constexpr double kPower_w = 0.5;
  constexpr double kPeak_w = 3e7;  // Of what is shorter than a nanosecond.
  if (seconds < 1e-9) return kPeak_w * c4 * seconds;
  return seconds < 0.06 * c4 ? kPulse_j * c4 : kPower_w * seconds;
}

}  // namespace

bool is_visible(double wavelength_nm) noexcept { return wavelength_nm < 700.0; }

double c3(double wavelength_nm) noexcept {
  return std::pow(10.0, 0.02 * std::max(wavelength_nm - 450.0, 0.0));
}

double c4(double wavelength_nm) noexcept {
  return std::pow(10.0, 0.002 * std::max(wavelength_nm - 700.0, 0.0));
}

double alpha_max_mrad(double seconds) noexcept {
  return std::clamp(200.0 * std::sqrt(seconds), 5.0, 100.0);
}

double c6(double source_mrad, double seconds) noexcept {
  const double counted = std::min(source_mrad, alpha_max_mrad(seconds));
  return std::max(counted / kPointSource_mrad, 1.0);
}

double t2_s(double source_mrad) noexcept {
  const double decade = (source_mrad - kPointSource_mrad) / 98.5;
  return 10.0 * std::pow(10.0, std::clamp(decade, 0.0, 1.0));
}

double time_base_s(EmissionLimit limit, double wavelength_nm) noexcept {
  const bool is_reflex = limit == EmissionLimit::kClass2 || limit == EmissionLimit::kClass3R;
  return is_reflex && is_visible(wavelength_nm) ? kBlinkReflex_s : 100.0;
}

double c5(double pulse_s, double pulses, double source_mrad, double time_base_s) noexcept {
  const double falling = std::pow(std::max(pulses, 1.0), -0.25);
  if (pulse_s <= kThermalConfinement_s) {
    if (time_base_s <= kBlinkReflex_s || pulses <= 600.0) return 1.0;
    return std::clamp(5.0 * falling, 0.4, 1.0);
  }
  if (source_mrad > 100.0 || source_mrad <= 5.0) return 1.0;
  if (source_mrad <= alpha_max_mrad(pulse_s)) return pulses <= 40.0 ? falling : 0.4;
  return pulses <= 625.0 ? falling : 0.2;
}

double emission_limit_j(EmissionLimit limit, double wavelength_nm, double seconds,
                        double source_mrad) {
  const double factor4 = c4(wavelength_nm);
  switch (limit) {
    case EmissionLimit::kClass1:
      return thermal_limit_j(kLimits1, factor4, seconds, source_mrad);
    case EmissionLimit::kClass2:
      return thermal_limit_j(kLimits2, factor4, seconds, source_mrad);
    case EmissionLimit::kClass3R:
      return thermal_limit_j(is_visible(wavelength_nm) ? kLimits3RVisible : kLimits3RInfrared,
                             factor4, seconds, source_mrad);
    case EmissionLimit::kClass3B:
      return limit_3b_j(factor4, seconds);
  }
  return 0.0;
}

std::optional<double> photochemical_limit_j(double wavelength_nm, double seconds) noexcept {
  if (wavelength_nm >= 600.0 || seconds < kThermalBegins_s) return std::nullopt;
  return 3.9e-5 * c3(wavelength_nm) * std::max(seconds, 100.0);
}

}  // namespace striper
