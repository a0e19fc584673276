// SPDX-License-Identifier: Apache-2.0
// striper guide align: zeros and scales of beams and gun, and the valves' delays, from a drive
// along a taped line and a tape measure.
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/guidance/beam_alignment.hpp>
#include <striper/guidance/gun_alignment.hpp>

#include "guide/guide_commands.hpp"
#include "guide/run_files.hpp"
#include "guide/run_inputs.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

constexpr double kMillimetre_m = 1e-3;
constexpr double kMillisecond_s = 1e-3;

struct AlignArguments {
  std::string run;
  std::string output;
  std::optional<std::string> config;
  std::optional<std::string> tape;
  std::optional<std::string> volts;
  std::optional<std::string> painted;
  bool json = false;
};

constexpr const char* kDescription =
    "Align beams and gun by a taped line: zeros, scales and delays, each with its sigma.";

constexpr const char* kHelp =
    "RUN is a drive beside a straight taped line, with some wander. Beside it, by a tape measure:\n"
    "  tape.csv     time_s,x_m,lateral_m[,sigma_m]: where the line was beside the truck (m, left), "
    "at\n"
    "               x_m before the gun, while it stood; at the front and the rear beam, ten stops\n"
    "  volts.csv    volts,lateral_m[,sigma_m]: where the gun stood for a voltage of the output\n"
    "  painted.csv  gun,state,signal_m,speed_m_s,painted_m[,sigma_m]: ends that the gun painted, "
    "ON\n"
    "               or OFF, with from_m or to_m of guns.csv, at two speeds: the valves' delays\n"
    "Of the last two what is not there is not aligned. What they do not determine is refused (exit "
    "3),\n"
    "and nothing is written. Sigmas go into the lateral sigma of every later job.\n\n"
    "Examples:\n"
    "  striper guide align taped -o aligned.yaml\n"
    "  striper guide align taped --painted painted.csv -o aligned.yaml --json";

void define(Command& command, AlignArguments& arguments) {
  command.add_option("RUN", arguments.run, "The directory of the recorded drive")->required();
  command.add_option("-o,--output", arguments.output, "The aligned guidance.yaml")
      ->type_name("FILE")
      ->required();
  const auto file = [&](const char* option, std::optional<std::string>& value, const char* what) {
    command.add_option(option, value, what)->type_name("FILE");
  };
  file("--config", arguments.config, "The truck; default: the run's own guidance.yaml");
  file("--tape", arguments.tape, "Default: the run's tape.csv");
  file("--volts", arguments.volts, "Default: the run's volts.csv, where there is one");
  file("--painted", arguments.painted, "Default: the run's painted.csv, where there is one");
  command.add_flag("--json", arguments.json, "The figures for programs on the standard output");
  command.footer(kHelp);
}

template <typename Row>
std::vector<Row> read_rows(const fs::path& file, std::span<const CsvColumn<Row>> columns,
                           std::string_view what) {
  CsvReader<Row> reader(CsvInput::open(file), columns, what);
  std::vector<Row> rows;
  for (Row row; reader.next(row); row = {}) rows.push_back(row);
  return rows;
}

// The file that was named, or the run's own; empty where that is not there.
fs::path file_of(const std::optional<std::string>& named, const AlignArguments& arguments,
                 const char* own) {
  if (named) return *named;
  const fs::path file = fs::path(arguments.run) / own;
  return fs::exists(file) ? file : fs::path();
}

std::string words_of(const AlignmentFinding& finding) {
  switch (finding.code) {
    case AlignmentFlaw::kNoTape:
      return "no reading of the tape is at a time when the beams saw the line";
    case AlignmentFlaw::kNotSeen:
      return fmt::format("beam {} did not see the line", finding.beam);
    case AlignmentFlaw::kZero:
      return fmt::format(
          "beam {}: its zero is known to {:.2f} mm only (at most {:.2f}): measure with the tape at "
          "two places of the truck, and more often",
          finding.beam, finding.value / kMillimetre_m, finding.limit / kMillimetre_m);
    case AlignmentFlaw::kScale:
      return fmt::format(
          "beam {}: its scale is known to {:.1f} % only (at most {:.1f}): wander more beside the "
          "line, and measure at both ends of that",
          finding.beam, 100.0 * finding.value, 100.0 * finding.limit);
    case AlignmentFlaw::kTape:
      return fmt::format(
          "tape and beams disagree by {:.1f} sigma (at most {:.1f}): is a reading or a time wrong?",
          finding.value, finding.limit);
    case AlignmentFlaw::kLine:
      return fmt::format(
          "beams disagree by {:.1f} mm along the drive (at most {:.1f}): is the line straight?",
          finding.value / kMillimetre_m, finding.limit / kMillimetre_m);
  }
  return {};
}

void say_beams(const BeamAlignment& beams, const GuidanceConfig& config) {
  say(fmt::format("{} along the drive, {} of the tape; beams agree to {:.2f} mm",
                  count(beams.places, "place"), count(beams.tape_readings, "reading"),
                  beams.line_rms_m / kMillimetre_m));
  for (std::size_t i = 0; i < config.beams.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 * i);
    say(fmt::format("beam {}: zero {:.3f} +- {:.3f} in, scale {:.4f} +- {:.4f}",
                    config.beams[i].name, beams.zero_m[i] / kInch_m,
                    std::sqrt(beams.covariance(at, at)) / kInch_m, beams.scale[i],
                    std::sqrt(beams.covariance(at + 1, at + 1))));
  }
}

nlohmann::json json_of(const BeamAlignment& beams, const GuidanceConfig& config) {
  nlohmann::json json{{"places", beams.places},           {"tape_readings", beams.tape_readings},
                      {"tape_rms", beams.tape_rms},       {"line_rms_m", beams.line_rms_m},
                      {"beams", nlohmann::json::array()}, {"refused", nlohmann::json::array()}};
  for (std::size_t i = 0; i < config.beams.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 * i);
    json["beams"].push_back({{"name", config.beams[i].name},
                             {"zero_m", beams.zero_m[i]},
                             {"scale", beams.scale[i]},
                             {"sigma_zero_m", std::sqrt(beams.covariance(at, at))},
                             {"sigma_scale", std::sqrt(beams.covariance(at + 1, at + 1))}});
  }
  for (const AlignmentFinding& finding : beams.findings) {
    json["refused"].push_back({{"code", to_string(finding.code)},
                               {"beam", finding.beam},
                               {"value", finding.value},
                               {"limit", finding.limit}});
  }
  return json;
}

// What each part of the command found; whether all of it may be written.
struct Outcome {
  nlohmann::json json;
  bool is_trusted = true;
};

void align_beams(const AlignArguments& arguments, GuidanceConfig& config, Outcome& outcome) {
  const fs::path file = file_of(arguments.tape, arguments, "tape.csv");
  if (file.empty()) {
    throw Error(ErrorKind::kNotFound,
                fmt::format("there is no tape.csv in {}, and no --tape", arguments.run));
  }
  const auto tape = read_rows(file, tape_columns(), "table of tape readings");
  const TerminalEvents events;
  RunInputs inputs(arguments.run, config, events.port());
  AlignmentDrive drive(config);
  while (inputs.give_next(drive)) {
    if (stop_requested()) throw Error(ErrorKind::kDevice, "interrupted");
  }
  const BeamAlignment beams = drive.solve(tape);
  say_beams(beams, config);
  for (const AlignmentFinding& finding : beams.findings)
    say(fmt::format("refused: {}", words_of(finding)));
  outcome.json = json_of(beams, config);
  outcome.is_trusted = beams.is_trusted();
  if (outcome.is_trusted) apply(beams, config);
}

void align_volts(const AlignArguments& arguments, GuidanceConfig& config, Outcome& outcome) {
  const fs::path file = file_of(arguments.volts, arguments, "volts.csv");
  if (file.empty()) return;
  const auto readings = read_rows(file, volts_columns(), "table of voltages");
  const OutputAlignment output = align_output(readings);
  say(fmt::format("output: zero {:.3f} +- {:.3f} in, {:.4f} +- {:.4f} V/in",
                  output.offset_m / kInch_m, output.sigma_offset_m / kInch_m,
                  output.volts_per_m * kInch_m, output.sigma_volts_per_m * kInch_m));
  outcome.json["output"] = {{"offset_m", output.offset_m},
                            {"volts_per_m", output.volts_per_m},
                            {"sigma_offset_m", output.sigma_offset_m},
                            {"sigma_volts_per_m", output.sigma_volts_per_m},
                            {"misfit", output.misfit},
                            {"is_trusted", output.is_trusted}};
  if (!output.is_trusted) {
    say("refused: volts.csv does not determine the output: three places or more, further apart");
    outcome.is_trusted = false;
    return;
  }
  apply(output, config);
}

void align_painted(const AlignArguments& arguments, GuidanceConfig& config, Outcome& outcome) {
  const fs::path file = file_of(arguments.painted, arguments, "painted.csv");
  if (file.empty()) return;
  outcome.json["guns"] = nlohmann::json::array();
  for (const GunAlignment& gun :
       align_guns(read_rows(file, painted_columns(), "table of painted ends"))) {
    say(
        fmt::format("gun {}: at {:.3f} +- {:.3f} m, on {:.1f} +- {:.1f} ms, off {:.1f} +- {:.1f} "
                    "ms late",
                    gun.gun, gun.x_m, gun.sigma_x_m, gun.on_delay_s / kMillisecond_s,
                    gun.sigma_on_s / kMillisecond_s, gun.off_delay_s / kMillisecond_s,
                    gun.sigma_off_s / kMillisecond_s));
    outcome.json["guns"].push_back({{"name", gun.gun},
                                    {"x_m", gun.x_m},
                                    {"on_delay_s", gun.on_delay_s},
                                    {"off_delay_s", gun.off_delay_s},
                                    {"sigma_x_m", gun.sigma_x_m},
                                    {"sigma_on_s", gun.sigma_on_s},
                                    {"sigma_off_s", gun.sigma_off_s},
                                    {"misfit", gun.misfit},
                                    {"is_trusted", gun.is_trusted}});
    if (!gun.is_trusted) {
      say(fmt::format("refused: gun {}: paint at two speeds, further apart, and measure more ends",
                      gun.gun));
      outcome.is_trusted = false;
      continue;
    }
    apply(gun, config);
  }
}

// What was measured by hand or driven is not written over.
void require_not_read(const AlignArguments& arguments, const GuidanceConfig& config) {
  std::vector<fs::path> read = run_files(arguments.run, config);
  for (const auto* named : {&arguments.tape, &arguments.volts, &arguments.painted}) {
    if (*named) read.emplace_back(**named);
  }
  for (const fs::path& file : read) {
    if (!is_same_file(arguments.output, file)) continue;
    throw Error(ErrorKind::kUsage, fmt::format("-o {}: {} is read by this command - name another "
                                               "file",
                                               arguments.output, file.string()));
  }
}

ExitCode guide_align(const AlignArguments& arguments) {
  GuidanceConfig config = load_guidance(
      arguments.config ? fs::path(*arguments.config) : fs::path(arguments.run) / "guidance.yaml");
  require_not_read(arguments, config);
  Outcome outcome;
  align_beams(arguments, config, outcome);
  align_volts(arguments, config, outcome);
  align_painted(arguments, config, outcome);
  outcome.json["written"] = outcome.is_trusted;
  if (outcome.is_trusted) {
    config.validate();
    write_file_atomically(arguments.output, format_guidance(config));
    say(fmt::format("wrote {}", arguments.output));
  }
  if (arguments.json) print_json(outcome.json);
  return outcome.is_trusted ? ExitCode::kDone : ExitCode::kUntrustworthy;
}

}  // namespace

void add_guide_align(Command& guide, Action& action) {
  add_command<AlignArguments>(guide, action, "align", kDescription, define, guide_align);
}

}  // namespace striper::program
