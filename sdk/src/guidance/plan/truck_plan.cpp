// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/beam_weights.hpp>
#include <striper/guidance/truck_plan.hpp>

namespace striper {
namespace {

constexpr std::array<std::string_view, kPlanWarnings> kWords{
    "one_beam",     "bend_error", "spacing",         "step",     "window",
    "acceleration", "feedback",   "retroreflection", "odometer", "valve"};

// Section 2.1: "a fairly small observation angle (less than 0.3 degrees)".
constexpr double kBeads_rad = 0.3 * std::numbers::pi / 180.0;
// An end is known to a count; a quarter of the spacing adds 3 % to its spread.
constexpr double kCountShare = 0.25;

double gun_x_m(const GuidanceConfig& truck) {
  return truck.guns.empty() ? 0.0 : truck.guns.front().gun.x_m;
}

double foremost_gun_m(const GuidanceConfig& truck) {
  double x_m = gun_x_m(truck);
  for (const GuidanceGun& gun : truck.guns) x_m = std::max(x_m, gun.gun.x_m);
  return x_m;
}

// Aside of the tangent, on a circle.
double aside_m(double along_m, double radius_m) {
  const double reach_m = std::min(std::abs(along_m), radius_m);
  return radius_m - std::sqrt(radius_m * radius_m - reach_m * reach_m);
}

double largest_step_m(const GuidanceBeam& beam) {
  double largest_m = 0.0;
  for (int i = 0; i + 1 < beam.samples; ++i) {
    largest_m = std::max(largest_m, beam.lateral_m(i) - beam.lateral_m(i + 1));
  }
  return largest_m;
}

BeamPlan plan_beam(const GuidanceConfig& truck, const GuidanceBeam& beam, double weight,
                   const TruckPlanOptions& options) {
  BeamPlan plan;
  plan.name = beam.name;
  plan.x_m = beam.x_m;
  plan.weight = weight;
  plan.spacing_m = options.speed_m_s / beam.rate_hz;
  plan.speed_m_s = options.spacing_m * beam.rate_hz;
  plan.halved_m_s = 2.0 * plan.speed_m_s;
  plan.step_m = largest_step_m(beam);
  plan.skew_m = options.speed_m_s * beam.sweep_s;
  plan.slant_m = std::hypot(beam.x_m, beam.height_m);
  plan.grazing_rad = std::atan2(beam.height_m, std::abs(beam.x_m));
  if (beam.kind == BeamKind::kDiffuse || !beam.head.empty()) {
    plan.observation_rad = std::atan2(options.baseline_m, plan.slant_m);
  }
  plan.bend_m = aside_m(beam.x_m - gun_x_m(truck), options.radius_m);
  plan.window_m = std::min(beam.lateral_m(0.0), -beam.lateral_m(beam.samples - 1));
  return plan;
}

void find_of_beam(const GuidanceBeam& beam, const BeamPlan& plan, const GuidanceConfig& truck,
                  const TruckPlanOptions& options, std::vector<PlanFinding>& findings) {
  const bool is_forward = plan.x_m > foremost_gun_m(truck);
  if (is_forward && plan.spacing_m > options.spacing_m) {
    findings.push_back({PlanWarning::kSpacing, plan.name, plan.spacing_m, options.spacing_m});
  }
  if (plan.step_m > options.step_m) {
    findings.push_back({PlanWarning::kStep, plan.name, plan.step_m, options.step_m});
  }
  // The whole stripe must be in it.
  const double needed_m = plan.bend_m + 0.5 * truck.stripe.width_m;
  if (needed_m > plan.window_m) {
    findings.push_back({PlanWarning::kWindow, plan.name, needed_m, plan.window_m});
  }
  if (beam.kind == BeamKind::kRetro && plan.observation_rad > kBeads_rad) {
    findings.push_back(
        {PlanWarning::kRetroreflection, plan.name, plan.observation_rad, kBeads_rad});
  }
  if (!is_forward && beam.use == BeamUse::kOn && plan.x_m < gun_x_m(truck)) {
    findings.push_back({PlanWarning::kFeedback, plan.name, 1.0 / (1.0 - plan.weight), 1.0});
  }
}

void find_of_truck(const GuidanceConfig& truck, const TruckPlan& plan,
                   const TruckPlanOptions& options, std::vector<PlanFinding>& findings) {
  if (plan.beams.size() == 1) findings.push_back({PlanWarning::kOneBeam, {}, 1.0, 2.0});
  if (std::abs(plan.bend_error_m) > options.bend_error_m) {
    findings.push_back(
        {PlanWarning::kBendError, {}, std::abs(plan.bend_error_m), options.bend_error_m});
  }
  if (plan.acceleration_m_s2 > options.acceleration_m_s2) {
    findings.push_back(
        {PlanWarning::kAcceleration, {}, plan.acceleration_m_s2, options.acceleration_m_s2});
  }
  if (plan.count_m > kCountShare * options.spacing_m) {
    findings.push_back({PlanWarning::kOdometer, {}, plan.count_m, kCountShare * options.spacing_m});
  }
  for (const GuidanceGun& gun : truck.guns) {
    const double needed_s = std::max(gun.gun.on_delay_s, gun.gun.off_delay_s);
    if (needed_s > plan.preview_s) {
      findings.push_back({PlanWarning::kValve, gun.name, needed_s, plan.preview_s});
    }
  }
}

// What a forward beam has of speed is that at which ends are known to half the asked spacing.
void list_limits(const GuidanceConfig& truck, TruckPlan& plan) {
  double first_m = 0.0;
  for (const BeamPlan& beam : plan.beams) {
    const double ahead_m = beam.x_m - foremost_gun_m(truck);
    if (ahead_m > 0.0) plan.limits.push_back({"beam " + beam.name, beam.speed_m_s});
    first_m = std::max(first_m, ahead_m);
  }
  plan.limits.push_back({"bend", plan.speed_in_bend_m_s});
  for (const GuidanceGun& gun : truck.guns) {
    const double needed_s = std::max(gun.gun.on_delay_s, gun.gun.off_delay_s);
    if (needed_s > 0.0) plan.limits.push_back({"gun " + gun.name, first_m / needed_s});
  }
  std::stable_sort(
      plan.limits.begin(), plan.limits.end(),
      [](const SpeedLimit& a, const SpeedLimit& b) { return a.speed_m_s < b.speed_m_s; });
}

}  // namespace

std::string_view to_string(PlanWarning warning) noexcept {
  return kWords[static_cast<std::size_t>(warning)];
}

void TruckPlanOptions::validate() const {
  require_value(speed_m_s > 0.0 && speed_m_s <= 60.0, "TruckPlanOptions::speed_m_s", speed_m_s,
                "above 0, up to 60");
  require_value(radius_m >= 1.0 && radius_m <= 1e6, "TruckPlanOptions::radius_m", radius_m,
                "1 to 1e6");
  require_value(spacing_m > 0.0 && spacing_m <= 10.0, "TruckPlanOptions::spacing_m", spacing_m,
                "above 0, up to 10");
  require_value(step_m > 0.0 && step_m <= 1.0, "TruckPlanOptions::step_m", step_m,
                "above 0, up to 1");
  require_value(bend_error_m > 0.0 && bend_error_m <= 1.0, "TruckPlanOptions::bend_error_m",
                bend_error_m, "above 0, up to 1");
  require_value(acceleration_m_s2 > 0.0 && acceleration_m_s2 <= 50.0,
                "TruckPlanOptions::acceleration_m_s2", acceleration_m_s2, "above 0, up to 50");
  require_value(baseline_m > 0.0 && baseline_m <= 10.0, "TruckPlanOptions::baseline_m", baseline_m,
                "above 0, up to 10");
}

TruckPlan plan_truck(const GuidanceConfig& truck, const TruckPlanOptions& options) {
  truck.validate();
  options.validate();
  std::vector<const GuidanceBeam*> used;
  std::vector<double> beam_x_m;
  for (const GuidanceBeam& beam : truck.beams) {
    if (beam.use == BeamUse::kOff) continue;
    used.push_back(&beam);
    beam_x_m.push_back(beam.x_m);
  }
  const std::vector<double> weights = beam_weights(beam_x_m, gun_x_m(truck));
  TruckPlan plan;
  double squares = 0.0;
  double first_m = 0.0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const BeamPlan beam = plan_beam(truck, *used[i], weights[i], options);
    squares += weights[i] * weights[i];
    plan.bend_error_m += weights[i] * beam.bend_m;
    first_m = std::max(first_m, beam.x_m - foremost_gun_m(truck));
    find_of_beam(*used[i], beam, truck, options, plan.findings);
    plan.beams.push_back(beam);
  }
  plan.noise_gain = std::sqrt(squares);
  plan.acceleration_m_s2 = options.speed_m_s * options.speed_m_s / options.radius_m;
  plan.speed_in_bend_m_s = std::sqrt(options.acceleration_m_s2 * options.radius_m);
  plan.radius_at_speed_m = options.speed_m_s * options.speed_m_s / options.acceleration_m_s2;
  plan.count_m = 1.0 / std::abs(truck.odometer.counts_per_m);
  plan.preview_s = first_m / options.speed_m_s;
  find_of_truck(truck, plan, options, plan.findings);
  list_limits(truck, plan);
  return plan;
}

}  // namespace striper
