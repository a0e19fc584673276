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
#include "guide/run_inputs.hpp"
#include "program.hpp"
#include "summary.hpp"
#include "terminal.hpp"
#include "terminal_events.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

struct RunArguments {
  std::string run;
  std::string output;
  std::optional<std::string> config;
  std::optional<std::string> method;
  std::optional<double> alpha;
  std::vector<std::string> to;
  bool json = false;
};

constexpr const char* kDescription =
    "Run guidance over what a truck has recorded: where the stripe is at the gun, when guns paint.";

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
    "Examples:\n"
    "  striper guide run run -o job\n"
    "  striper guide run run --method report --alpha 0.9 -o as-in-1991\n"
    "  striper guide run run --config other.yaml -o other --json\n"
    "  striper guide run run -o job --to can:can0";

void define(CLI::App& command, RunArguments& arguments) {
  command.add_option("RUN", arguments.run, "The directory of the recorded run")->required();
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
      ->check(CLI::Range(0.0, 0.999));
  command.add_option("--to", arguments.to, kGuidanceOutputsHelp)
      ->type_name("OUTPUT")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  command.footer(kHelp);
}

GuidanceConfig config_of(const RunArguments& arguments) {
  const fs::path file =
      arguments.config ? fs::path(*arguments.config) : fs::path(arguments.run) / "guidance.yaml";
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

// Writes what guidance says; faults are said on the terminal, too.
class RunTables : public GuidanceListener {
 public:
  explicit RunTables(const fs::path& directory)
      : lateral_((directory / "lateral.csv").string(), lateral_columns()),
        guns_((directory / "guns.csv").string(), gun_columns()),
        seen_((directory / "seen.csv").string(), seen_columns()),
        faults_((directory / "faults.csv").string(), fault_columns()) {}

  void lateral(const LateralLine& line) override {
    lateral_.add(line);
    if (++waiting_ % 256 == 0) flush();
  }
  void gun(const GunLine& line) override { guns_.add(line); }
  void seen(const SeenLine& line) override { seen_.add(line); }
  void fault(const FaultLine& line) override {
    faults_.add(line);
    constexpr int kMost = 10;
    if (++said_ > kMost) return;
    say(fmt::format("fault at {:.3f} s: {}; {}", line.time_s, to_string(line.code),
                    to_string(line.action)));
  }

  void close() {
    lateral_.close();
    guns_.close();
    seen_.close();
    faults_.close();
  }

 private:
  void flush() {
    lateral_.flush();
    guns_.flush();
    seen_.flush();
    faults_.flush();
  }

  CsvWriter<LateralLine> lateral_;
  CsvWriter<GunLine> guns_;
  CsvWriter<SeenLine> seen_;
  CsvWriter<FaultLine> faults_;
  std::uint64_t waiting_ = 0;
  int said_ = 0;
};

nlohmann::json json_of(const GuidanceTotals& totals, const GuidanceStripe& stripe) {
  nlohmann::json json{{"sweeps", totals.sweeps},
                      {"sweeps_of_unknown_beams", totals.unknown_sweeps},
                      {"scans", totals.scans},
                      {"way_m", totals.way_m},
                      {"longest_gap_m", totals.longest_gap_m},
                      {"gap_limit_m", stripe.gap_limit_m},
                      {"dashes_lost", totals.dashes_lost},
                      {"dashes_not_allowed", totals.dashes_not_allowed}};
  constexpr std::array kStates{"tracking", "bridging", "lost", "fault"};
  for (std::size_t i = 0; i < kStates.size(); ++i) {
    json["scans_of_state"][kStates[i]] = totals.scans_of_state[i];
  }
  json["guns"] = nlohmann::json::array();
  for (const GuidanceTotals::Gun& gun : totals.guns) {
    nlohmann::json one{{"name", gun.name}, {"on_m", gun.on_m}, {"dashes", gun.dashes}};
    if (std::isfinite(gun.cycle_m)) {
      one["pattern"] = {{"dash_m", gun.dash_m},
                        {"gap_m", gun.cycle_m - gun.dash_m},
                        {"quality", gun.pattern_quality}};
    }
    json["guns"].push_back(one);
  }
  for (std::size_t i = 0; i < kSeenKinds; ++i) {
    json["seen"][std::string(to_string(static_cast<SeenKind>(i)))] = totals.seen[i];
  }
  for (std::size_t i = 0; i < kGuidanceFaults; ++i) {
    json["faults"][std::string(to_string(static_cast<GuidanceFault>(i)))] = totals.faults[i];
  }
  return json;
}

void say_totals(const GuidanceTotals& totals, const GuidanceStripe& stripe) {
  const auto share = [&](PathState state) {
    return 100.0 * static_cast<double>(totals.scans_of_state[static_cast<std::size_t>(state)]) /
           static_cast<double>(std::max<std::uint64_t>(totals.scans, 1));
  };
  say(
      fmt::format("{:.1f} m in {}; the stripe tracked in {:.1f} %, bridged in {:.1f} %, lost in "
                  "{:.1f} %, faults in {:.1f} %",
                  totals.way_m, count(totals.scans, "scan"), share(PathState::kTracking),
                  share(PathState::kBridging), share(PathState::kLost), share(PathState::kFault)));
  say(fmt::format("longest gap: {:.2f} m of at most {:.2f} m", totals.longest_gap_m,
                  stripe.gap_limit_m));
  for (const GuidanceTotals::Gun& gun : totals.guns) {
    std::string text =
        fmt::format("{}: {:.2f} m painted, switched on {} times", gun.name, gun.on_m, gun.dashes);
    if (std::isfinite(gun.cycle_m)) {
      text += fmt::format("; a pattern of {:.2f} m and {:.2f} m gap", gun.dash_m,
                          gun.cycle_m - gun.dash_m);
    }
    say(text);
  }
  std::string seen;
  for (const SeenKind kind : {SeenKind::kMarker, SeenKind::kTape, SeenKind::kSpot, SeenKind::kCross,
                              SeenKind::kLetter, SeenKind::kWet}) {
    const auto number = totals.seen[static_cast<std::size_t>(kind)];
    if (number > 0)
      seen += fmt::format("{}{} {}", seen.empty() ? "" : ", ", number, to_string(kind));
  }
  if (!seen.empty()) say("no stripe: " + seen);
  constexpr double kBackwards_m = -1.0;
  if (totals.way_m < kBackwards_m) {
    say("by its odometer the truck went backwards: is the sign of counts_per_m right?");
  }
  if (totals.unknown_sweeps > 0) {
    say(fmt::format("{} of beams that guidance.yaml does not name",
                    count(totals.unknown_sweeps, "sweep")));
  }
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

ExitCode guide_run(const RunArguments& arguments) {
  if (arguments.json && std::count(arguments.to.begin(), arguments.to.end(), "-") > 0) {
    throw Error(ErrorKind::kUsage, "--json and --to - both write to the standard output");
  }
  const TerminalEvents events;
  const GuidanceConfig config = config_of(arguments);
  const fs::path output = arguments.output;
  if (fs::exists(output) && fs::equivalent(output, arguments.run)) {
    throw Error(ErrorKind::kUsage, "-o names the run itself: its guidance.yaml would be replaced");
  }
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
  RunInputs inputs(arguments.run, config, events.port());
  fs::create_directories(output);
  RunTables tables(output);
  GuidanceOutputs outputs(arguments.to, config);
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
                                                 arguments.run));
  }
  say_totals(totals, config.stripe);
  say(fmt::format("wrote lateral.csv, guns.csv, seen.csv and faults.csv into {}",
                  arguments.output));
  if (arguments.json) print_json(json_of(totals, config.stripe));
  return is_all_sent ? ExitCode::kDone : ExitCode::kFailed;
}

}  // namespace

void add_guide_run(CLI::App& guide, Action& action) {
  add_command<RunArguments>(guide, action, "run", kDescription, define, guide_run);
}

}  // namespace striper::program
