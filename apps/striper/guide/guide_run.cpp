// SPDX-License-Identifier: Apache-2.0
// striper guide run: a recorded run through guidance, to tables.
#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/guidance/guidance.hpp>
#include <striper/stream/rig_file.hpp>

#include "guide/guidance_outputs.hpp"
#include "guide/guide_commands.hpp"
#include "guide/live/live_run.hpp"
#include "guide/recorded_run.hpp"
#include "guide/run_tables.hpp"
#include "options/option_bounds.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

struct RunArguments {
  std::optional<std::string> run;
  std::string output;
  std::optional<std::string> config;
  std::optional<std::string> method;
  std::optional<double> alpha;
  std::vector<std::string> to;
  bool json = false;
  std::vector<std::string> heads;
  std::vector<std::string> models;
  std::optional<std::string> rig;
  std::optional<std::string> record;
  std::optional<double> seconds;
  bool resume = false;
};

constexpr const char* kDescription =
    "Run guidance over what a truck has recorded, or live: where the stripe is at the gun, when "
    "guns "
    "paint.";

constexpr const char* kHelp =
    "The directory gets\n"
    "  lateral.csv  time_s,odometer_counts,distance_m,lateral_m,sigma_m,volts,beams,state: a line "
    "a\n"
    "               scan; lateral_m to the left, state tracking, bridging (a gap), lost or fault\n"
    "  guns.csv     gun,state,from_counts,to_counts,from_m,to_m,length_m,total_m: ON and OFF in "
    "turn\n"
    "  seen.csv     time_s,odometer_counts,distance_m,beam,kind,lateral_m,length_m,reason: ends "
    "of\n"
    "               dashes, lines, and what is no stripe: markers, tapes, spots, crosses, letters\n"
    "  faults.csv   time_s,code,action,latency_s\n"
    "  guidance.yaml  what was run with\n"
    "The same run with the same settings gives the same files, bit for bit.\n\n"
    "--to can:can0 sends lateral position, guns and faults over CAN, at the pace of the run; the "
    "frames\n"
    "are described by data/can/guidance.dbc ('?id=800' moves the first of their four "
    "identifiers).\n"
    "candump:FILE is a log of the same frames, which canplayer plays.\n\n"
    "With --head or --rig it runs live, on the cameras of the beams' heads, until Ctrl-C. The\n"
    "odometer is what odometer: source: of the file, or of the rig, says: encoder (of the first\n"
    "head's camera; the default), serial:DEVICE?baud=19200 with a line COUNTS for each reading, "
    "or\n"
    "can:can0 with the frames TRUCK_ODOMETER and TRUCK_STATE of data/can/guidance.dbc ('?id=', "
    "and\n"
    "'&start=7&size=32&order=big' for a counter in a frame of the truck's own). Where nothing "
    "comes\n"
    "in for .25 s guns are off and the voltage is the safe one. Lasers are on while it runs; "
    "where\n"
    "the mirror stops they go off and stay off. job.json keeps totals and lasers, second by "
    "second;\n"
    "--resume goes on with them, with tables of its own in part-2, part-3, ...\n\n"
    "Examples:\n"
    "  striper guide run run -o job\n"
    "  striper guide run run --method report --alpha 0.9 -o as-in-1991\n"
    "  striper guide run run --config other.yaml -o other --json\n"
    "  striper guide run run -o job --to can:can0\n"
    "  striper guide run --config truck.yaml --head 'truck=gige:STRIPER1?encoder=yes&laser=0,1,2' "
    "\\\n"
    "      --model truck=striper.yaml -o job --record run\n"
    "  striper guide run --config truck.yaml --rig rig.yaml -o job --to can:can0";

void define_live(Command& command, CommandOption* run, RunArguments& arguments) {
  auto* const head =
      command.add_option("--head", arguments.heads, "Live: where a head's frames come from")
          ->type_name("NAME=SOURCE")
          ->one_word_each()
          ->excludes(run);
  command.add_option("--model", arguments.models, "And its model; as often as there are heads")
      ->type_name("NAME=FILE")
      ->one_word_each()
      ->needs(head);
  command.add_option("--rig", arguments.rig, "Live: the heads, and the odometer, of a rig")
      ->type_name("RIG.yaml")
      ->excludes(run)
      ->excludes(head);
  command.add_option("--record", arguments.record, "Keep what came in, as a RUN of its own")
      ->type_name("RUN");
  command.add_option("--seconds", arguments.seconds, "End after so long; default: Ctrl-C")
      ->type_name("S")
      ->check(above_zero());
  command.add_flag("--resume", arguments.resume, "Go on with the job that is in DIR");
}

void define(Command& command, RunArguments& arguments) {
  auto* const run =
      command.add_option("RUN", arguments.run, "The directory of the recorded run; or --head");
  command
      .add_option(
          "-o,--output", arguments.output,
          "The directory for the results; it is made, and tables of an earlier recorded run in it "
          "are replaced")
      ->type_name("DIR")
      ->required();
  command
      .add_option("--config", arguments.config,
                  "Truck, stripe and outputs; default: the run's own guidance.yaml")
      ->type_name("FILE");
  command
      .add_option("--method", arguments.method,
                  "How the path is followed: filter, report (the 1991 method); default as the "
                  "file says")
      ->type_name("METHOD")
      ->check(one_of({"filter", "report", "exponential", "integer"}));
  command.add_option("--alpha", arguments.alpha, "Smoothing of the method report, 0 to below 1")
      ->type_name("A")
      ->check(between(0.0, 0.999));
  command.add_option("--to", arguments.to, kGuidanceOutputsHelp)
      ->type_name("OUTPUT")
      ->one_word_each();
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  define_live(command, run, arguments);
  command.footer(kHelp);
}

GuidanceConfig config_of(const RunArguments& arguments) {
  const fs::path file =
      arguments.config ? fs::path(*arguments.config) : fs::path(*arguments.run) / "guidance.yaml";
  GuidanceConfig config = load_guidance(file);
  if (arguments.alpha) config.smoothing.alpha = *arguments.alpha;
  if (!arguments.method) return config;
  constexpr std::array kMethods{std::pair("filter", PathMethod::kFilter),
                                std::pair("report", PathMethod::kReport),
                                std::pair("exponential", PathMethod::kExponential),
                                std::pair("integer", PathMethod::kInteger)};
  for (const auto& [word, method] : kMethods) {
    if (*arguments.method == word) config.smoothing.method = method;
  }
  return config;
}

// --json and each output `-` write to the same place.
void require_one_at_standard_output(const RunArguments& arguments) {
  const auto to_output =
      std::count_if(arguments.to.begin(), arguments.to.end(),
                    [](const std::string& to) { return to == "-" || to.ends_with(":-"); });
  if (to_output + (arguments.json ? 1 : 0) > 1) {
    throw Error(ErrorKind::kUsage, "--json and each --to - write to the standard output: one may");
  }
}

void warn_of_few_beams(const GuidanceConfig& config) {
  const auto used = std::count_if(config.beams.begin(), config.beams.end(),
                                  [](const GuidanceBeam& b) { return b.use != BeamUse::kOff; });
  if (used == 2) {
    say("note: two beams alone do not tell an offset from a bend; without a gyroscope's yaw rate "
        "lateral_m may be inches off in bends");
  }
  if (used < 2) {
    say("warning: one beam alone tells neither the direction of the stripe nor its bend; lateral_m "
        "may be off by a foot, and sigma_m does not say so");
  }
}

ExitCode guide_recorded(const RunArguments& arguments, const GuidanceConfig& config) {
  RecordedRunOptions options{*arguments.run, arguments.output, arguments.to, {}};
  if (arguments.config) options.taken.emplace_back(*arguments.config);
  const RunOutcome outcome = run_recorded(config, options);
  if (outcome.totals.sweeps == 0 && !outcome.was_interrupted) {
    throw Error(ErrorKind::kBadFile, fmt::format("{} has no sweeps of the beams that guidance.yaml "
                                                 "names",
                                                 *arguments.run));
  }
  say_totals(outcome.totals, config.stripe);
  say(fmt::format("wrote lateral.csv, guns.csv, seen.csv and faults.csv into {}",
                  arguments.output));
  if (outcome.was_interrupted) say("interrupted: they hold what was read until then");
  if (arguments.json) {
    nlohmann::json summary = json_of(outcome.totals, config.stripe);
    summary["interrupted"] = outcome.was_interrupted;
    print_json(summary);
  }
  return outcome.is_all_sent && !outcome.was_interrupted ? ExitCode::kDone : ExitCode::kFailed;
}

ExitCode guide_live(const RunArguments& arguments, GuidanceConfig config) {
  LiveRunOptions live;
  if (arguments.rig) {
    const RigFile rig = load_rig(*arguments.rig);
    live.heads = live_heads(rig);
    take_odometer(rig, *arguments.rig, config);
    live.taken.emplace_back(*arguments.rig);
  } else {
    live.heads = live_heads(arguments.heads, arguments.models);
  }
  live.taken.emplace_back(*arguments.config);
  for (const LiveHead& head : live.heads) live.taken.emplace_back(head.model);
  live.output = arguments.output;
  if (arguments.record) live.record = *arguments.record;
  live.to = arguments.to;
  live.seconds = arguments.seconds;
  live.resumes = arguments.resume;
  const LiveOutcome outcome = run_live(config, live);
  say(fmt::format(
      "wrote the job into {}{}", arguments.output,
      arguments.record ? fmt::format(", what came in into {}", *arguments.record) : std::string()));
  if (arguments.json) {
    nlohmann::json summary = json_of(outcome.totals, config.stripe);
    summary["laser"] = to_string(outcome.laser);
    print_json(summary);
  }
  return outcome.totals.sweeps > 0 && outcome.is_all_sent ? ExitCode::kDone : ExitCode::kFailed;
}

ExitCode guide_run(const RunArguments& arguments) {
  const bool is_live = arguments.rig || !arguments.heads.empty();
  if (!arguments.run && !is_live) {
    throw Error(ErrorKind::kUsage,
                "expected the directory of a run, --head NAME=SOURCE or --rig RIG.yaml");
  }
  if (is_live && !arguments.config) {
    throw Error(ErrorKind::kUsage, "a live run needs --config: the truck's guidance.yaml");
  }
  if (!is_live && (arguments.record || arguments.seconds || arguments.resume)) {
    throw Error(ErrorKind::kUsage,
                "--record, --seconds and --resume are of live runs: with --head or --rig");
  }
  require_one_at_standard_output(arguments);
  const GuidanceConfig config = config_of(arguments);
  warn_of_few_beams(config);
  return is_live ? guide_live(arguments, config) : guide_recorded(arguments, config);
}

}  // namespace

void add_guide_run(Command& guide, Action& action) {
  add_command<RunArguments>(guide, action, "run", kDescription, define, guide_run);
}

}  // namespace striper::program
