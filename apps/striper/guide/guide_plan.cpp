// SPDX-License-Identifier: Apache-2.0
// striper guide plan: what a truck can do, before it drives.
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/units.hpp>
#include <striper/guidance/truck_plan.hpp>

#include "guide/guide_commands.hpp"
#include "options/option_bounds.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

constexpr double kGravity_m_s2 = 9.80665;

struct PlanArguments {
  std::optional<std::string> truck;
  TruckPlanOptions options;
  bool json = false;
};

constexpr const char* kDescription =
    "Work out what a truck can do before it drives: speeds, noise at the gun, bends, what limits.";

constexpr const char* kHelp =
    "Without a file it is the truck of the 1991 report. Warnings come last; a plan with warnings "
    "is\n"
    "a plan.\n\n"
    "Examples:\n"
    "  striper guide plan\n"
    "  striper guide plan truck.yaml --speed 13.4 --radius 131 --json";

void define(Command& command, PlanArguments& arguments) {
  TruckPlanOptions& options = arguments.options;
  command.add_option("TRUCK.yaml", arguments.truck, "The truck, a guidance.yaml");
  command.add_option("--speed", options.speed_m_s, "That is asked of it, m/s; default 40 mph")
      ->type_name("M_PER_S")
      ->check(between(0.1, 60.0));
  command.add_option("--radius", options.radius_m, "Of the tightest bend; default 50 ft")
      ->type_name("M")
      ->check(between(1.0, 1e6));
  command
      .add_option("--spacing", options.spacing_m,
                  "Between two sweeps of a beam at most; default 4 in")
      ->type_name("M")
      ->check(between(0.001, 10.0));
  command
      .add_option("--acceleration", options.acceleration_m_s2,
                  "Sideways, that the truck stands, m/s2; default a quarter of gravity")
      ->type_name("A")
      ->check(between(0.1, 50.0));
  command
      .add_option("--baseline", options.baseline_m,
                  "From a striper's camera to its laser; default 0.5")
      ->type_name("M")
      ->check(between(0.001, 10.0));
  command.add_flag("--json", arguments.json, "The figures for programs on the standard output");
  command.footer(kHelp);
}

std::string words_of(const PlanFinding& finding) {
  const double in = finding.value / kInch_m;
  const double most_in = finding.limit / kInch_m;
  switch (finding.code) {
    case PlanWarning::kOneBeam:
      return "one beam tells neither the stripe's direction nor its bend";
    case PlanWarning::kBendError:
      return fmt::format("in this bend the beams are {:.2f} in wrong at the gun (at most {:.2f})",
                         in, most_in);
    case PlanWarning::kSpacing:
      return fmt::format("beam {}: sweeps are {:.1f} in apart at this speed (at most {:.1f})",
                         finding.of, in, most_in);
    case PlanWarning::kStep:
      return fmt::format("beam {}: samples are {:.2f} in apart (at most {:.2f})", finding.of, in,
                         most_in);
    case PlanWarning::kWindow:
      return fmt::format(
          "beam {}: this bend takes the stripe to {:.1f} in, the window ends at "
          "{:.1f}",
          finding.of, in, most_in);
    case PlanWarning::kAcceleration:
      return fmt::format("this bend at this speed is {:.2f} g; the truck stands {:.2f}",
                         finding.value / kGravity_m_s2, finding.limit / kGravity_m_s2);
    case PlanWarning::kFeedback:
      return fmt::format(
          "beam {} sees what the gun has painted: errors grow {:.2f} times; say "
          "use: old-only",
          finding.of, finding.value);
    case PlanWarning::kRetroreflection:
      return fmt::format(
          "beam {}: its camera is {:.1f} degrees off its laser and sees no beads "
          "(within {:.1f}); say kind: diffuse",
          finding.of, finding.value / kDegree, finding.limit / kDegree);
    case PlanWarning::kOdometer:
      return fmt::format("a count of the odometer is {:.2f} in long (at most {:.2f})", in, most_in);
    case PlanWarning::kValve:
      return fmt::format("gun {}: its valve needs {:.2f} s, from beam to gun it is {:.2f} s",
                         finding.of, finding.value, finding.limit);
  }
  return {};
}

void print_beams(const TruckPlan& plan) {
  fmt::print(
      "beam       x_ft  weight  4_in_mph  2x_mph  apart_in  step_in  skew_in  grazing_deg  "
      "observed_deg\n");
  for (const BeamPlan& beam : plan.beams) {
    const std::string observed = std::isnan(beam.observation_rad)
                                     ? std::string("along")
                                     : fmt::format("{:.1f}", beam.observation_rad / kDegree);
    fmt::print("{:9} {:5.1f} {:7.3f} {:9.1f} {:7.1f} {:9.1f} {:8.2f} {:8.2f} {:12.1f}  {:>12}\n",
               beam.name, beam.x_m / kFoot_m, beam.weight, beam.speed_m_s / kMph_m_s,
               beam.halved_m_s / kMph_m_s, beam.spacing_m / kInch_m, beam.step_m / kInch_m,
               beam.skew_m / kInch_m, beam.grazing_rad / kDegree, observed);
  }
}

void print_plan(const TruckPlan& plan, const TruckPlanOptions& options) {
  print_beams(plan);
  fmt::print("\nat {:.1f} mph, in a bend of {:.0f} ft\n", options.speed_m_s / kMph_m_s,
             options.radius_m / kFoot_m);
  const auto row = [](const char* what, const std::string& value) {
    fmt::print("  {:34} {}\n", what, value);
  };
  row("noise at the gun over a beam's", fmt::format("{:.3f}", plan.noise_gain));
  row("error at the gun in the bend", fmt::format("{:.4f} in", plan.bend_error_m / kInch_m));
  row("sideways", fmt::format("{:.2f} g", plan.acceleration_m_s2 / kGravity_m_s2));
  row("the truck stands in the bend", fmt::format("{:.1f} mph", plan.speed_in_bend_m_s / kMph_m_s));
  row("and at the speed", fmt::format("{:.0f} ft", plan.radius_at_speed_m / kFoot_m));
  row("a count of the odometer", fmt::format("{:.2f} in", plan.count_m / kInch_m));
  row("from the first beam to the gun", fmt::format("{:.3f} s", plan.preview_s));
  fmt::print("\nwhat limits, the slowest first\n");
  for (const SpeedLimit& limit : plan.limits) {
    row(limit.by.c_str(), fmt::format("{:.1f} mph", limit.speed_m_s / kMph_m_s));
  }
  for (const PlanFinding& finding : plan.findings) {
    fmt::print("\nwarning: {}: {}", to_string(finding.code), words_of(finding));
  }
  if (!plan.findings.empty()) fmt::print("\n");
}

nlohmann::json json_of(const BeamPlan& beam) {
  nlohmann::json json{{"name", beam.name},           {"x_m", beam.x_m},
                      {"weight", beam.weight},       {"spacing_m", beam.spacing_m},
                      {"speed_m_s", beam.speed_m_s}, {"halved_m_s", beam.halved_m_s},
                      {"step_m", beam.step_m},       {"skew_m", beam.skew_m},
                      {"slant_m", beam.slant_m},     {"grazing_rad", beam.grazing_rad},
                      {"bend_m", beam.bend_m},       {"window_m", beam.window_m}};
  json["observation_rad"] = nullptr;
  if (std::isfinite(beam.observation_rad)) json["observation_rad"] = beam.observation_rad;
  return json;
}

nlohmann::json json_of(const TruckPlan& plan) {
  nlohmann::json json{{"noise_gain", plan.noise_gain},
                      {"bend_error_m", plan.bend_error_m},
                      {"acceleration_m_s2", plan.acceleration_m_s2},
                      {"speed_in_bend_m_s", plan.speed_in_bend_m_s},
                      {"radius_at_speed_m", plan.radius_at_speed_m},
                      {"count_m", plan.count_m},
                      {"preview_s", plan.preview_s},
                      {"beams", nlohmann::json::array()},
                      {"limits", nlohmann::json::array()},
                      {"warnings", nlohmann::json::array()}};
  for (const BeamPlan& beam : plan.beams) json["beams"].push_back(json_of(beam));
  for (const SpeedLimit& limit : plan.limits) {
    json["limits"].push_back({{"by", limit.by}, {"speed_m_s", limit.speed_m_s}});
  }
  for (const PlanFinding& finding : plan.findings) {
    json["warnings"].push_back({{"code", to_string(finding.code)},
                                {"of", finding.of},
                                {"value", finding.value},
                                {"limit", finding.limit},
                                {"message", words_of(finding)}});
  }
  return json;
}

ExitCode guide_plan(const PlanArguments& arguments) {
  const GuidanceConfig truck = arguments.truck ? load_guidance(*arguments.truck) : report_truck();
  const TruckPlan plan = plan_truck(truck, arguments.options);
  if (arguments.json) {
    print_json(json_of(plan));
  } else {
    print_plan(plan, arguments.options);
  }
  return ExitCode::kDone;
}

}  // namespace

void add_guide_plan(Command& guide, Action& action) {
  add_command<PlanArguments>(guide, action, "plan", kDescription, define, guide_plan);
}

}  // namespace striper::program
