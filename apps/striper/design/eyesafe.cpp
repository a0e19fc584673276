// SPDX-License-Identifier: Apache-2.0
// striper eyesafe: which class a laser is of, what limits it, how near one may come.
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/design/eye_safety.hpp>

#include "options/option_bounds.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct EyesafeArguments {
  double wavelength_nm = 900.0;
  std::optional<double> energy_uj;
  std::optional<double> pulse_s;
  std::optional<double> rate_hz;
  std::optional<double> power_mw;
  std::optional<double> fan_deg;
  std::optional<double> thickness_deg;
  std::optional<double> beam_mm;
  std::optional<double> divergence_mrad;
  double closest_m = 0.0;
  double source_mrad = kPointSource_mrad;
  std::optional<double> scan_speed_rad_s;
  bool failsafe = false;
  std::string standard = "iec2014";
  bool json = false;
};

constexpr const char* kDescription =
    "Tell a laser's class after IEC 60825-1:2014, what limits it and how near one may come.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper eyesafe --wavelength 900 --energy 10.43 --pulse 1e-6 --rate 30 --fan 60\n"
    "      --thickness 0.4 --closest 0.6       the striper of Mertz et al. 2002: 1M today\n"
    "  striper eyesafe --wavelength 632.8 --power 2.33      a steady beam, all of it: 3R\n"
    "  striper eyesafe --wavelength 900 --energy 10.4 --pulse 1e-6 --rate 30 --fan 60\n"
    "      --thickness 0.4 --closest 0.6 --standard ansi1993      as the paper computes it\n\n"
    "This is no certificate: what was not checked is said at the end (`not_checked`). Exit code 0\n"
    "whatever the class.";

void define_emission(Command& command, EyesafeArguments& arguments) {
  command.add_option("--wavelength", arguments.wavelength_nm, "400 to 1050 nanometres")
      ->type_name("NM")
      ->required();
  auto* const energy =
      command.add_option("--energy", arguments.energy_uj, "Of a pulse, microjoule")
          ->type_name("UJ")
          ->check(at_least(0.0));
  auto* const pulse =
      command.add_option("--pulse", arguments.pulse_s, "How long it lasts, 1e-13 to 0.25 s")
          ->type_name("S")
          ->check(between(1e-13, 0.25));
  auto* const rate = command.add_option("--rate", arguments.rate_hz, "Pulses a second")
                         ->type_name("HZ")
                         ->check(between(1e-6, 1e9));
  energy->needs(pulse)->needs(rate);
  pulse->needs(energy);
  rate->needs(energy);
  command.add_option("--power", arguments.power_mw, "Of a steady beam instead, milliwatt")
      ->type_name("MW")
      ->check(at_least(0.0))
      ->excludes(energy);
}

void define_beam(Command& command, EyesafeArguments& arguments) {
  auto* const fan =
      command.add_option("--fan", arguments.fan_deg, "Full angle of the fan, degrees")
          ->type_name("DEG")
          ->check(between(1e-3, 180.0));
  auto* const thickness = command
                              .add_option("--thickness", arguments.thickness_deg,
                                          "Of the laser plane, full angle, degrees")
                              ->type_name("DEG")
                              ->check(between(1e-3, 180.0));
  fan->needs(thickness);
  thickness->needs(fan);
  auto* const beam =
      command.add_option("--beam", arguments.beam_mm, "Of a round beam: where it leaves, mm")
          ->type_name("MM")
          ->check(between(0.0, 1000.0))
          ->excludes(fan);
  command.add_option("--divergence", arguments.divergence_mrad, "And how it widens, full angle")
      ->type_name("MRAD")
      ->check(between(0.0, 3141.0))
      ->needs(beam);
  beam->needs(command.get_option("--divergence"));
}

void define(Command& command, EyesafeArguments& arguments) {
  define_emission(command, arguments);
  define_beam(command, arguments);
  command.add_option("--closest", arguments.closest_m, "How near a person can come, metres")
      ->type_name("M")
      ->check(between(0.0, 1e4))
      ->capture_default_str();
  command
      .add_option("--source", arguments.source_mrad,
                  "Angle of an extended source seen from there; 1.5 is a point")
      ->type_name("MRAD")
      ->check(between(kPointSource_mrad, 100.0))
      ->capture_default_str();
  auto* const failsafe = command.add_flag("--failsafe", arguments.failsafe,
                                          "A safeguard ends the light with the scan");
  auto* const speed = command
                          .add_option("--scan-speed", arguments.scan_speed_rad_s,
                                      "How fast a steady beam is turned; only with --failsafe")
                          ->type_name("RAD_S")
                          ->check(between(1.0, 1e6))
                          ->needs(failsafe);
  failsafe->needs(speed);
  command.add_option("--standard", arguments.standard, "iec2014, or ansi1993 as the paper")
      ->check(one_of({"iec2014", "ansi1993"}))
      ->capture_default_str();
  command.add_flag("--json", arguments.json, "For programs, on the standard output");
  command.footer(kExamples);
}

EyeSafetyInput input_of(const EyesafeArguments& arguments) {
  EyeSafetyInput input;
  input.standard =
      arguments.standard == "ansi1993" ? LaserStandard::kAnsi1993 : LaserStandard::kIec2014;
  input.wavelength_nm = arguments.wavelength_nm;
  if (arguments.energy_uj) {
    if (arguments.scan_speed_rad_s)
      throw Error(ErrorKind::kUsage, "--scan-speed is for a steady beam (--power), not for pulses");
    input.emission =
        PulsedEmission{1e-6 * *arguments.energy_uj, *arguments.pulse_s, *arguments.rate_hz};
  } else if (arguments.power_mw) {
    input.emission = ContinuousEmission{1e-3 * *arguments.power_mw, arguments.scan_speed_rad_s};
  } else {
    throw Error(ErrorKind::kUsage, "give --energy, --pulse and --rate, or --power");
  }
  if (arguments.fan_deg)
    input.beam = FanBeam{kDegree * *arguments.fan_deg, kDegree * *arguments.thickness_deg};
  if (arguments.beam_mm)
    input.beam = RoundBeam{1e-3 * *arguments.beam_mm, 1e-3 * *arguments.divergence_mrad};
  input.closest_m = arguments.closest_m;
  input.source_mrad = arguments.source_mrad;
  return input;
}

nlohmann::json to_json(const EyeSafetyReport& report) {
  nlohmann::json json;
  json["class"] = to_string(report.laser_class);
  const EmissionCheck& limiting = report.limiting;
  json["limiting"] = {{"rule", limiting.rule},
                      {"condition", limiting.condition},
                      {"table", limiting.table},
                      {"ael", limiting.ael},
                      {"unit", limiting.unit}};
  json["fraction_of_limit"] = report.fraction_of_limit;
  json["max_energy_uj"] = 1e6 * report.max_energy_j;
  json["max_power_mw"] = 1e3 * report.max_power_w;
  json["closest_safe_m"] = report.closest_safe_m;
  json["closest_unaided_m"] = report.closest_unaided_m;
  json["steps"] = nlohmann::json::array();
  for (const EyeSafetyStep& step : report.steps)
    json["steps"].push_back({{"name", step.name}, {"value", step.value}, {"unit", step.unit}});
  json["not_checked"] = report.not_checked;
  return json;
}

// A number in the unit that leaves it between 1 and 1000 where possible.
std::string readable(double value, const std::string& unit) {
  if (unit != "J" && unit != "W") return fmt::format("{:.4g} {}", value, unit);
  if (value >= 1.0) return fmt::format("{:.4g} {}", value, unit);
  return value >= 1e-3 ? fmt::format("{:.4g} m{}", 1e3 * value, unit)
                       : fmt::format("{:.4g} u{}", 1e6 * value, unit);
}

std::string readable(const EyeSafetyStep& step) {
  return step.unit.empty() ? fmt::format("{:.4g}", step.value) : readable(step.value, step.unit);
}

std::string distance_text(double distance_m) {
  if (std::isnan(distance_m)) return "at no distance";
  return distance_m > 0.0 ? fmt::format("from {:.3g} m on", distance_m) : "at any distance";
}

void print_report(const EyesafeArguments& arguments, const EyeSafetyReport& report) {
  std::string text = fmt::format("class {}\n", to_string(report.laser_class));
  const EmissionCheck& limiting = report.limiting;
  const char* const unit = arguments.energy_uj ? "J" : "W";
  text += fmt::format(
      "class 1 is limited to {}{} by condition {} ({}), {}; emitted is {:.3g} times as much\n",
      readable(limiting.largest, unit), arguments.energy_uj ? " a pulse" : "", limiting.condition,
      limiting.condition == 1 ? "a telescope" : "the bare eye", limiting.rule,
      report.fraction_of_limit);
  text += fmt::format("class 1 {}; without a telescope {}\n", distance_text(report.closest_safe_m),
                      distance_text(report.closest_unaided_m));
  for (const EyeSafetyStep& step : report.steps)
    text += fmt::format("  {:<36} {}\n", step.name, readable(step));
  fmt::print("{}", text);
  say("no certificate; not checked:");
  for (const std::string& one : report.not_checked) say("  " + one);
}

ExitCode eyesafe(const EyesafeArguments& arguments) {
  const EyeSafetyReport report = assess_eye_safety(input_of(arguments));
  if (arguments.json)
    print_json(to_json(report));
  else
    print_report(arguments, report);
  return ExitCode::kDone;
}

}  // namespace

void add_eyesafe(Command& striper, Action& action) {
  add_command<EyesafeArguments>(striper, action, "eyesafe", kDescription, define, eyesafe);
}

}  // namespace striper::program
