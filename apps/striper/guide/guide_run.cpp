// SPDX-License-Identifier: Apache-2.0
// striper guide run: a recorded run through guidance, to tables.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/guidance/guidance.hpp>

#include "guide/guidance_outputs.hpp"
#include "guide/guide_commands.hpp"
#include "guide/live/live_run.hpp"
#include "guide/run_inputs.hpp"
#include "guide/run_tables.hpp"
#include "option_bounds.hpp"
#include "program.hpp"
#include "summary.hpp"
#include "terminal.hpp"
#include "terminal_events.hpp"

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
    "With --head it runs live, on the cameras of the beams' heads, until Ctrl-C. The odometer is "
    "what\n"
    "odometer: source: of the file says: encoder (of the first head's camera; the default), or\n"
    "serial:DEVICE?baud=19200 with a line COUNTS for each reading. job.json keeps the totals, "
    "second\n"
    "by second; --resume goes on with them, with tables of its own in part-2, part-3, ...\n\n"
    "Examples:\n"
    "  striper guide run run -o job\n"
    "  striper guide run run --method report --alpha 0.9 -o as-in-1991\n"
    "  striper guide run run --config other.yaml -o other --json\n"
    "  striper guide run run -o job --to can:can0\n"
    "  striper guide run --config truck.yaml --head 'truck=gige:STRIPER1?encoder=yes&laser=0,1,2' "
    "\\\n"
    "      --model truck=striper.yaml -o job --record run";

CommandOption* define_live(Command& command, RunArguments& arguments) {
  auto* const head =
      command.add_option("--head", arguments.heads, "Live: where a head's frames come from")
          ->type_name("NAME=SOURCE")
          ->one_word_each();
  command.add_option("--model", arguments.models, "And its model; as often as there are heads")
      ->type_name("NAME=FILE")
      ->one_word_each()
      ->needs(head);
  command.add_option("--record", arguments.record, "Keep what came in, as a RUN of its own")
      ->type_name("RUN")
      ->needs(head);
  command.add_option("--seconds", arguments.seconds, "End after so long; default: Ctrl-C")
      ->type_name("S")
      ->check(above_zero())
      ->needs(head);
  command.add_flag("--resume", arguments.resume, "Go on with the job that is in DIR")->needs(head);
  return head;
}

void define(Command& command, RunArguments& arguments) {
  auto* const run =
      command.add_option("RUN", arguments.run, "The directory of the recorded run; or --head");
  command.add_option("-o,--output", arguments.output, "The directory for the results; it is made")
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
  define_live(command, arguments)->excludes(run);
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

// Waits until an input is due, of a run that began when this was made; less where it is to stop.
class RunPace {
 public:
  void wait_for(double time_s) {
    if (!std::isfinite(time_s)) return;
    if (std::isnan(first_s_)) first_s_ = time_s;
    const auto due = begin_ + std::chrono::duration_cast<Clock::duration>(
                                  std::chrono::duration<double>(time_s - first_s_));
    while (!stop_requested() && Clock::now() < due) {
      std::this_thread::sleep_until(std::min(due, Clock::now() + kLongest));
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kLongest{50};

  Clock::time_point begin_ = Clock::now();
  double first_s_ = std::numeric_limits<double>::quiet_NaN();
};

void play(RunInputs& inputs, Guidance& guidance, bool is_live) {
  Progress progress("sweeps", std::nullopt);
  RunPace pace;
  while (!stop_requested()) {
    if (is_live) pace.wait_for(inputs.next_s());
    if (!inputs.give_next(guidance)) break;
    progress.update(inputs.sweeps());
  }
}

ExitCode run_recorded(const RunArguments& arguments, const GuidanceConfig& config) {
  const auto to_output =
      std::count_if(arguments.to.begin(), arguments.to.end(),
                    [](const std::string& to) { return to == "-" || to.ends_with(":-"); });
  if (to_output + (arguments.json ? 1 : 0) > 1) {
    throw Error(ErrorKind::kUsage, "--json and each --to - write to the standard output: one may");
  }
  const TerminalEvents events;
  const fs::path output = arguments.output;
  if (fs::exists(output) && fs::equivalent(output, *arguments.run)) {
    throw Error(ErrorKind::kUsage, "-o names the run itself: its guidance.yaml would be replaced");
  }
  RunInputs inputs(*arguments.run, config, events.port());
  GuidanceOutputs outputs(arguments.to, config);  // Before the tables of an earlier job go.
  fs::create_directories(output);
  RunTables tables(output);
  outputs.add(tables);
  Guidance guidance(config, outputs);
  play(inputs, guidance, outputs.is_live());
  guidance.finish();
  const bool is_all_sent = outputs.finish();
  tables.close();
  write_file_atomically(output / "guidance.yaml", format_guidance(config));
  const GuidanceTotals totals = guidance.totals();
  if (totals.sweeps == 0) {
    throw Error(ErrorKind::kBadFile, fmt::format("{} has no sweeps of the beams that guidance.yaml "
                                                 "names",
                                                 *arguments.run));
  }
  say_totals(totals, config.stripe);
  say(fmt::format("wrote lateral.csv, guns.csv, seen.csv and faults.csv into {}",
                  arguments.output));
  if (arguments.json) print_json(json_of(totals, config.stripe));
  return is_all_sent ? ExitCode::kDone : ExitCode::kFailed;
}

ExitCode guide_run(const RunArguments& arguments) {
  if (!arguments.run && arguments.heads.empty()) {
    throw Error(ErrorKind::kUsage, "expected the directory of a run, or --head NAME=SOURCE");
  }
  if (!arguments.run && !arguments.config) {
    throw Error(ErrorKind::kUsage, "--head needs --config: the truck's guidance.yaml");
  }
  const GuidanceConfig config = config_of(arguments);
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
  if (arguments.run) return run_recorded(arguments, config);
  if (!arguments.to.empty()) {
    throw Error(ErrorKind::kUsage, "--to does not go with --head yet - record the run and play it");
  }
  LiveRunOptions live;
  live.heads = live_heads(arguments.heads, arguments.models);
  live.output = arguments.output;
  if (arguments.record) live.record = *arguments.record;
  live.seconds = arguments.seconds;
  live.resumes = arguments.resume;
  const GuidanceTotals totals = run_live(config, live);
  if (arguments.json) print_json(json_of(totals, config.stripe));
  return totals.sweeps > 0 ? ExitCode::kDone : ExitCode::kFailed;
}

}  // namespace

void add_guide_run(Command& guide, Action& action) {
  add_command<RunArguments>(guide, action, "run", kDescription, define, guide_run);
}

}  // namespace striper::program
