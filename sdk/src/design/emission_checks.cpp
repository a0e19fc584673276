// SPDX-License-Identifier: Apache-2.0
#include "design/emission_checks.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace striper {
namespace detail {
namespace {

// What an eye behind the aperture gets of one unit (J of a pulse, W of a steady beam) emitted.
struct Received {
  double per_unit;  // J of a received pulse, or W, per unit emitted.
  double pulse_s;
  double rate_hz;
  bool is_pulsed;
};

Received receive(const PulsedEmission& pulses, const Measurement&, double share) {
  return {share, pulses.pulse_s, pulses.rate_hz, true};
}

// A scanned beam is a pulse each time it passes the aperture.
Received receive(const ContinuousEmission& steady, const Measurement& at, double share) {
  if (!steady.scan_speed_rad_s) return {share, 0.0, 0.0, false};
  const double speed = *steady.scan_speed_rad_s;
  const double pass_s = at.aperture_m / (at.distance_m * speed);
  return {share * pass_s, pass_s, speed / (2.0 * std::numbers::pi), true};
}

const char* table_of(EmissionLimit limit, bool is_extended) {
  switch (limit) {
    case EmissionLimit::kClass1:
      return is_extended ? "IEC 60825-1:2014 Table 4" : "IEC 60825-1:2014 Table 3";
    case EmissionLimit::kClass2:
      return "IEC 60825-1:2014 class 2";
    case EmissionLimit::kClass3R:
      return "IEC 60825-1:2014 class 3R";
    case EmissionLimit::kClass3B:
      return "IEC 60825-1:2014 class 3B";
  }
  return "";
}

// Adds limits in the order in which they are found.
class CheckList {
 public:
  CheckList(EmissionLimit limit, const Measurement& at, const Received& received)
      : limit_(limit), at_(at), received_(received) {}

  void energy(const char* rule, double ael_j) { add(rule, ael_j, "J", ael_j / received_.per_unit); }

  // Of pulses, how much energy each may have for that mean power.
  void power(const char* rule, double ael_w, double pulses_per_s) {
    add(rule, ael_w, "W",
        received_.is_pulsed ? ael_w / pulses_per_s / received_.per_unit
                            : ael_w / received_.per_unit);
  }

  std::vector<EmissionCheck> take() { return std::move(checks_); }

 private:
  void add(const char* rule, double ael, const char* unit, double largest) {
    checks_.push_back({rule, at_.condition, table_of(limit_, at_.source_mrad > kPointSource_mrad),
                       ael, unit, largest});
  }

  EmissionLimit limit_;
  const Measurement& at_;
  const Received& received_;
  std::vector<EmissionCheck> checks_;
};

// Pulses that come within T_i act as one of T_i with all of their energy.
double train_limit_j(double wavelength_nm, EmissionLimit limit, const Measurement& at,
                     const Received& received) {
  const double base_s = time_base_s(limit, wavelength_nm);
  const double within = std::max(1.0, std::ceil(kThermalConfinement_s * received.rate_hz - 1e-9));
  const double rate_hz = std::min(received.rate_hz, 1.0 / kThermalConfinement_s);
  const double pulses = std::max(1.0, rate_hz * std::min(t2_s(at.source_mrad), base_s));
  const bool is_summed = within > 1.0 && received.pulse_s < kThermalConfinement_s;
  const double pulse_s = is_summed ? kThermalConfinement_s : received.pulse_s;
  return c5(pulse_s, pulses, at.source_mrad, base_s) *
         emission_limit_j(limit, wavelength_nm, pulse_s, at.source_mrad) /
         (is_summed ? within : 1.0);
}

}  // namespace

std::vector<Measurement> measurements(const EyeSafetyInput& input) {
  return {{1, 0.050, std::max(2.0, input.closest_m), kPointSource_mrad},
          {3, 0.007, std::max(0.1, input.closest_m), input.source_mrad}};
}

std::vector<EmissionCheck> checks_of(const EyeSafetyInput& input, EmissionLimit limit,
                                     const Measurement& at) {
  const double share = aperture_share(input.beam, at.aperture_m, at.distance_m);
  const Received received = std::visit(
      [&](const auto& emission) { return receive(emission, at, share); }, input.emission);
  const double nm = input.wavelength_nm;
  const double base_s = time_base_s(limit, nm);
  const double pulses_per_s = std::max(received.rate_hz, 1.0 / base_s);
  CheckList list(limit, at, received);
  if (received.is_pulsed)
    list.energy("single_pulse", emission_limit_j(limit, nm, received.pulse_s, at.source_mrad));
  list.power("mean_power", emission_limit_j(limit, nm, base_s, at.source_mrad) / base_s,
             pulses_per_s);
  if (received.is_pulsed && limit != EmissionLimit::kClass3B)
    list.energy("pulse_train", train_limit_j(nm, limit, at, received));
  const auto photochemical_j = photochemical_limit_j(nm, base_s);
  if (limit == EmissionLimit::kClass1 && photochemical_j)
    list.power("photochemical", *photochemical_j / base_s, pulses_per_s);
  return list.take();
}

double emitted(const EyeSafetyInput& input) {
  if (const auto* pulses = std::get_if<PulsedEmission>(&input.emission)) return pulses->energy_j;
  return std::get<ContinuousEmission>(input.emission).power_w;
}

}  // namespace detail

double aperture_share(const std::variant<UnknownBeam, FanBeam, RoundBeam>& beam, double aperture_m,
                      double distance_m) {
  if (const auto* fan = std::get_if<FanBeam>(&beam)) {
    const double along = std::min(1.0, aperture_m / (distance_m * fan->fan_rad));
    return along * std::min(1.0, aperture_m / (distance_m * fan->thickness_rad));
  }
  if (const auto* round = std::get_if<RoundBeam>(&beam)) {
    const double diameter_m = round->diameter_m + round->divergence_rad * distance_m;
    return diameter_m > 0.0 ? -std::expm1(-std::pow(aperture_m / diameter_m, 2)) : 1.0;
  }
  return 1.0;
}

}  // namespace striper
