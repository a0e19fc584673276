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

#include "guide/live/job_totals.hpp"
#include "guide/run_tables.hpp"
#include "program.hpp"
#include "terminal.hpp"
#include "terminal_events.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kWait = 20ms;
constexpr auto kKeepEvery = 1s;
// Nothing for so long, while a truck drives, is no hiccup: at 40 mph it is 4.5 m.
constexpr auto kSilent = 250ms;

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
  void say_safe(double time_s, double volts_safe) {
    LateralLine line;
    line.time_s = time_s;
    line.odometer_counts = last_.odometer_counts;
    line.distance_m = last_.distance_m;
    line.volts = volts_safe;
    line.state = PathState::kFault;
    RunTables::lateral(line);
    flush();
  }

 private:
  LateralLine last_;
  bool wants_lasers_off_ = false;
};

class LiveRun {
 public:
  LiveRun(const GuidanceConfig& config, const LiveRunOptions& options)
      : config_(config),
        options_(options),
        job_(options.output, options.resumes),
        tables_(prepared(job_.tables())),
        heads_(options.heads, config, options.record, events_.port()),
        guidance_(config, tables_) {
    if (options.record.empty()) return;
    write_file_atomically(options.record / "guidance.yaml", format_guidance(config));
    odometer_.reset(new CsvWriter<OdometerReading>(
        make_odometer_csv((options.record / "odometer.csv").string())));
  }

  GuidanceTotals run() {
    heads_.start();
    laser_ = LaserState::kOn;
    say(job_.part() == 1 ? "guiding" : fmt::format("guiding: part {} of the job", job_.part()));
    const Clock::time_point begin = Clock::now();
    while (!stop_requested() && (is_open() || !heads_.inputs().is_over())) {
      if (options_.seconds &&
          Clock::now() - begin > std::chrono::duration<double>(*options_.seconds)) {
        break;
      }
      step();
      if (!heads_.is_any_running()) heads_.finish();
    }
    return conclude();
  }

 private:
  static const std::filesystem::path& prepared(const std::filesystem::path& directory) {
    std::filesystem::create_directories(directory);
    return directory;
  }
  bool is_open() const { return heads_.is_any_running(); }

  void step() {
    if (const auto input = heads_.inputs().next(kWait)) {
      take(*input);
    } else {
      look_at_silence();
    }
    if (tables_.take_laser_wish() && laser_ == LaserState::kOn) {
      laser_ = LaserState::kLocked;
      heads_.switch_lasers_off();
      say("lasers off: they stay off until guidance is started again");
    }
    if (Clock::now() - kept_ < kKeepEvery) return;
    keep();
  }

  void take(const LiveInput& input) {
    heard_ = Clock::now();
    time_s_ = time_of(input);
    if (std::exchange(is_silent_, false)) say("inputs are back");
    if (const auto* reading = std::get_if<OdometerReading>(&input)) {
      if (odometer_) odometer_->add(*reading);
      guidance_.take(*reading);
    } else {
      guidance_.take(std::get<BeamSweep>(input));
    }
  }

  // Time goes on where nothing comes: on the inputs' clock, whichever that is.
  void look_at_silence() {
    if (!heads_.is_live() || !heard_ || Clock::now() - *heard_ < kSilent) return;
    const double now_s = time_s_ + std::chrono::duration<double>(Clock::now() - *heard_).count();
    guidance_.go_to(now_s);
    if (std::exchange(is_silent_, true)) return;
    say("nothing comes in: guns off, the safe voltage");
    tables_.say_safe(now_s, config_.output.volts_safe);
  }

  void keep() {
    kept_ = Clock::now();
    tables_.flush();
    if (odometer_) odometer_->flush();
    job_.keep(guidance_.totals(), laser_);
  }

  GuidanceTotals conclude() {
    heads_.finish();
    while (const auto input = heads_.inputs().next(0ms)) take(*input);
    guidance_.finish();
    if (laser_ == LaserState::kOn) laser_ = LaserState::kOff;
    const GuidanceTotals totals = guidance_.totals();
    job_.keep(totals, laser_);
    tables_.close();
    if (odometer_) odometer_->close();
    write_file_atomically(job_.tables() / "guidance.yaml", format_guidance(config_));
    say_totals(totals, config_.stripe);
    if (heads_.inputs().late() > 0) {
      say(fmt::format("{} came too late and were left out",
                      count(heads_.inputs().late(), "input")));
    }
    for (const auto& gun : totals.guns) say_job(gun);
    return totals;
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
  LiveTables tables_;
  LiveHeads heads_;
  Guidance guidance_;
  std::unique_ptr<CsvWriter<OdometerReading>> odometer_;
  LaserState laser_ = LaserState::kOff;
  std::optional<Clock::time_point> heard_;
  double time_s_ = 0.0;
  bool is_silent_ = false;
  Clock::time_point kept_ = Clock::now();
};

}  // namespace

std::vector<LiveHead> live_heads(const std::vector<std::string>& heads,
                                 const std::vector<std::string>& models) {
  std::vector<LiveHead> list;
  for (const std::string& text : heads) {
    const auto [name, source] = named(text, "--head");
    list.push_back({name, source, {}});
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

GuidanceTotals run_live(const GuidanceConfig& config, const LiveRunOptions& options) {
  std::filesystem::create_directories(options.output);
  if (!options.record.empty()) std::filesystem::create_directories(options.record);
  return LiveRun(config, options).run();
}

}  // namespace striper::program
