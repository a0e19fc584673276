// SPDX-License-Identifier: Apache-2.0
#include "guide/live/live_run.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/motion/odometer_csv.hpp>

#include "guide/guidance_outputs.hpp"
#include "guide/live/kept_file.hpp"
#include "guide/run_files.hpp"
#include "guide/run_tables.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kWait = 20ms;
constexpr auto kKeepEvery = 1s;
// Nothing for so long, while a truck drives, is no hiccup: at 40 mph it is 4.5 m.
constexpr auto kSilent = 250ms;
// So long without a reading the odometer is said to be silent: its wire or its address is wrong.
constexpr auto kOdometerSilent = 1s;

// NAME=VALUE.
std::pair<std::string, std::string> named(const std::string& text, const char* option) {
  const auto sign = text.find('=');
  if (sign == 0 || sign == std::string::npos || sign + 1 == text.size()) {
    throw Error(ErrorKind::kUsage, fmt::format("{} '{}': expected NAME=VALUE", option, text));
  }
  return {text.substr(0, sign), text.substr(sign + 1)};
}

// The tables, and what guidance wants done at once.
class LiveTables : public RunTables {
 public:
  explicit LiveTables(const std::filesystem::path& directory) : RunTables(directory) {}
  void lateral(const LateralLine& line) override {
    last_ = line;
    RunTables::lateral(line);
  }
  void switch_laser_off(double /*time_s*/) override { wants_lasers_off_ = true; }
  bool take_laser_wish() noexcept { return std::exchange(wants_lasers_off_, false); }

  // The output's drive has no other line: what it last heard would stand.
  LateralLine safe_line(double time_s, double volts_safe) const {
    LateralLine line;
    line.time_s = time_s;
    line.odometer_counts = last_.odometer_counts;
    line.distance_m = last_.distance_m;
    line.volts = volts_safe;
    line.state = PathState::kFault;
    return line;
  }

 private:
  LateralLine last_;
  bool wants_lasers_off_ = false;
};

// What came in beside the scans, as a recorded run has it.
class RunRecord {
 public:
  RunRecord(std::filesystem::path run, const GuidanceConfig& config) : run_(std::move(run)) {
    if (run_.empty()) return;
    write_file_atomically(run_ / "guidance.yaml", format_guidance(config));
    odometer_.reset(
        new CsvWriter<OdometerReading>(make_odometer_csv((run_ / "odometer.csv").string())));
  }

  void add(const LiveInput& input) {
    if (run_.empty()) return;
    if (const auto* reading = std::get_if<OdometerReading>(&input)) odometer_->add(*reading);
    const auto* state = std::get_if<TruckState>(&input);
    if (state == nullptr) return;
    if (!state_) {
      state_.reset(new CsvWriter<TruckState>((run_ / "state.csv").string(), truck_state_columns()));
    }
    state_->add(*state);
  }
  void flush() {
    if (odometer_) odometer_->flush();
    if (state_) state_->flush();
  }
  void close() {
    if (odometer_) odometer_->close();
    if (state_) state_->close();
  }

 private:
  std::filesystem::path run_;
  std::unique_ptr<CsvWriter<OdometerReading>> odometer_;
  std::unique_ptr<CsvWriter<TruckState>> state_;  // Where a truck says anything of itself.
};

GuidanceOutputs::Options output_options(const GuidanceConfig& config, const LiveRunOptions& options,
                                        const std::filesystem::path& tables) {
  GuidanceOutputs::Options outputs{true, options.taken};
  const auto take = [&](const std::vector<std::filesystem::path>& files) {
    outputs.taken.insert(outputs.taken.end(), files.begin(), files.end());
  };
  take(job_files(options.output));
  take(job_files(tables));
  if (!options.record.empty()) take(run_files(options.record, config));
  return outputs;
}

class LiveRun {
 public:
  LiveRun(const GuidanceConfig& config, const LiveRunOptions& options)
      : config_(config),
        options_(options),
        job_(options.output, options.resumes),
        outputs_(options.to, config, output_options(config, options, job_.tables())),
        tables_(prepared(job_.tables())),
        job_file_(job_.file()),
        heads_(options.heads, config, options.record, events_.port()),
        guidance_(config, outputs_),
        record_(options.record, config) {
    outputs_.add(tables_);
  }

  LiveOutcome run() {
    if (job_.was_locked()) say("the lasers were locked when the part before ended");
    try {
      heads_.start();
      laser_ = LaserState::kOn;
      say(job_.part() == 1 ? "guiding, lasers on"
                           : fmt::format("guiding, lasers on: part {} of the job", job_.part()));
      begin_ = Clock::now();
      while (goes_on()) step();
    } catch (...) {
      end_outputs();  // Before cameras are waited for.
      throw;
    }
    return conclude();
  }

 private:
  static const std::filesystem::path& prepared(const std::filesystem::path& directory) {
    make_directory(directory);
    return directory;
  }

  bool goes_on() {
    if (stop_requested()) return false;
    if (!heads_.is_any_running()) heads_.finish();
    const bool is_in_time =
        !options_.seconds ||
        Clock::now() - begin_ < std::chrono::duration<double>(*options_.seconds);
    return is_in_time && !heads_.inputs().is_over();
  }

  void step() {
    if (const auto input = heads_.inputs().next(kWait)) {
      take(*input);
    } else {
      look_at_silence();
    }
    look_at_odometer();
    if (tables_.take_laser_wish() && laser_ == LaserState::kOn) lock_lasers();
    if (Clock::now() - kept_ >= kKeepEvery) keep();
  }

  void take(const LiveInput& input) {
    taken_ = Clock::now();
    time_s_ = time_of(input);
    if (std::exchange(is_silent_, false)) say("inputs are back");
    record_.add(input);
    std::visit([this](const auto& one) { guidance_.take(one); }, input);
  }

  // Time goes on where nothing comes: on the inputs' clock, whichever that is.
  void look_at_silence() {
    const auto heard = heads_.inputs().heard();
    if (!heads_.is_live() || !taken_ || Clock::now() - *heard < kSilent) return;
    const double now_s = time_s_ + std::chrono::duration<double>(Clock::now() - *taken_).count();
    guidance_.go_to(now_s);
    if (std::exchange(is_silent_, true)) return;
    say("nothing comes in: guns off, the safe voltage");
    outputs_.make_safe(tables_.safe_line(now_s, config_.output.volts_safe));
    keep();
  }

  // Guidance has a fault for an odometer that stops; one that never began it does not miss.
  void look_at_odometer() {
    const auto heard = heads_.inputs().heard_odometer();
    const auto silent_since = heard ? *heard : begin_;
    const bool was_silent = is_odometer_silent_;
    is_odometer_silent_ = taken_ && !is_silent_ && Clock::now() - silent_since > kOdometerSilent;
    if (is_odometer_silent_ == was_silent) return;
    const std::string name = config_.odometer_source.empty() ? "encoder" : config_.odometer_source;
    if (was_silent) {
      if (heard && Clock::now() - *heard <= kOdometerSilent)
        say(fmt::format("odometer {} is back", name));
      return;
    }
    say(
        fmt::format("odometer {}: no reading for 1 s: nothing is painted without it - look at its "
                    "wire and at its address (encoder=, baud=, id=)",
                    name));
  }

  void lock_lasers() {
    laser_ = LaserState::kLocked;
    heads_.switch_lasers_off();
    say("lasers off: they stay off until guidance is started again");
    keep();
  }

  void keep() {
    kept_ = Clock::now();
    tables_.flush();
    record_.flush();
    job_file_.put(job_.text(guidance_.totals(), laser_));
    const auto failure = job_file_.take_failure();
    if (!failure) return;
    is_all_sent_ = false;
    if (!std::exchange(is_failure_said_, true)) say(fmt::format("{}; guidance goes on", *failure));
  }

  void end_outputs() {
    try {
      is_all_sent_ = outputs_.finish() && is_all_sent_;
    } catch (const Error& error) {
      is_all_sent_ = false;
      say(error.what());
    }
  }

  LiveOutcome conclude() {
    if (heads_.inputs().is_over()) {
      guidance_.finish();
      end_outputs();
    } else {
      end_outputs();  // Guns off first; cameras may take their time.
      heads_.finish();
      while (const auto input = heads_.inputs().next(0ms)) take(*input);
      guidance_.finish();
    }
    if (laser_ == LaserState::kOn) laser_ = LaserState::kOff;
    const GuidanceTotals totals = guidance_.totals();
    job_file_.close(job_.text(totals, laser_));
    tables_.close();
    record_.close();
    write_file_atomically(job_.tables() / "guidance.yaml", format_guidance(config_));
    say(fmt::format("lasers {}", to_string(laser_)));
    say_totals(totals, config_.stripe);
    if (heads_.inputs().late() > 0) {
      say(fmt::format("{} came too late and were left out",
                      count(heads_.inputs().late(), "input")));
    }
    for (const auto& gun : totals.guns) say_job(gun);
    return {totals, laser_, is_all_sent_};
  }

  void say_job(const GuidanceTotals::Gun& gun) const {
    const auto before = job_.guns().find(gun.name);
    if (before == job_.guns().end()) return;
    say(fmt::format("{} in the whole job: {:.2f} m painted, switched on {} times", gun.name,
                    before->second.on_m + gun.on_m, before->second.dashes + gun.dashes));
  }

  const GuidanceConfig& config_;
  const LiveRunOptions& options_;
  TerminalEvents events_;
  JobTotals job_;
  GuidanceOutputs outputs_;
  LiveTables tables_;
  KeptFile job_file_;
  LiveHeads heads_;
  Guidance guidance_;
  RunRecord record_;
  LaserState laser_ = LaserState::kOff;
  std::optional<Clock::time_point> taken_;  // When the last input was.
  double time_s_ = 0.0;
  bool is_silent_ = false;
  bool is_odometer_silent_ = false;
  bool is_all_sent_ = true;
  bool is_failure_said_ = false;  // Of the job's totals.
  Clock::time_point begin_ = Clock::now();
  Clock::time_point kept_ = Clock::now();
};

}  // namespace

std::vector<LiveHead> live_heads(const std::vector<std::string>& heads,
                                 const std::vector<std::string>& models) {
  std::vector<LiveHead> list;
  for (const std::string& text : heads) {
    const auto [name, source] = named(text, "--head");
    list.push_back({name, source, {}, {}});
  }
  for (const std::string& text : models) {
    const auto [name, file] = named(text, "--model");
    const auto of = std::find_if(list.begin(), list.end(),
                                 [&name = name](const LiveHead& h) { return h.name == name; });
    if (of == list.end()) {
      throw Error(ErrorKind::kUsage, fmt::format("--model {}: there is no --head {}", text, name));
    }
    of->model = file;
  }
  for (const LiveHead& head : list) {
    if (!head.model.empty()) continue;
    throw Error(ErrorKind::kUsage, fmt::format("expected --model {}=FILE", head.name));
  }
  return list;
}

std::vector<LiveHead> live_heads(const RigFile& rig) {
  std::vector<LiveHead> list;
  for (const RigHead& head : rig.heads) {
    list.push_back({head.name, head.source, head.model.string(), head.options});
  }
  return list;
}

void take_odometer(const RigFile& rig, const std::string& file, GuidanceConfig& config) {
  if (!rig.odometer || !config.odometer_source.empty()) return;
  const OdometerOptions& truck = config.odometer;
  if (rig.odometer->counts_per_m != truck.counts_per_m || rig.odometer->bits != truck.bits) {
    throw Error(ErrorKind::kUsage,
                fmt::format("{}: the odometer has {} counts a metre and {} bits - expected {} and "
                            "{}, as the truck's file has them",
                            file, rig.odometer->counts_per_m, rig.odometer->bits,
                            truck.counts_per_m, truck.bits));
  }
  config.odometer_source = rig.odometer->source;
}

namespace {

// Neither needs to exist.
bool is_same_folder(const std::filesystem::path& a, const std::filesystem::path& b) {
  const auto whole = [](const std::filesystem::path& path) {
    return (std::filesystem::weakly_canonical(std::filesystem::absolute(path)) / "").parent_path();
  };
  return whole(a) == whole(b);
}

}  // namespace

LiveOutcome run_live(const GuidanceConfig& config, const LiveRunOptions& options) {
  if (!options.record.empty() && is_same_folder(options.record, options.output)) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("--record {} and -o {} are one directory: the job's guidance.yaml would "
                    "replace the run's - name two",
                    options.record.string(), options.output.string()));
  }
  if (!options.resumes) require_free_for_job(options.output);
  make_directory(options.output);
  if (!options.record.empty()) make_run_directory(options.record);
  return LiveRun(config, options).run();
}

}  // namespace striper::program
