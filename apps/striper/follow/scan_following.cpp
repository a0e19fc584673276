// SPDX-License-Identifier: Apache-2.0
#include "follow/scan_following.hpp"

#include <chrono>
#include <cmath>
#include <memory>
#include <set>
#include <string>

#include <fmt/format.h>

#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/motion/odometer.hpp>
#include <striper/motion/odometer_csv.hpp>
#include <striper/scans/open_scans.hpp>
#include <striper/stream/open_sink.hpp>

#include "follow/scan_pace.hpp"
#include "options/option_bounds.hpp"
#include "options/own_files.hpp"
#include "options/sink_arguments.hpp"
#include "program/plot_file.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

/// The vehicle's motion at the scans' times, as a wheel's counter says.
class WheelMotion {
 public:
  WheelMotion(const std::string& file, double counts_per_m)
      : readings_(open_odometer_csv(file)), odometer_(options_of(counts_per_m)) {}

  /// None before the first reading and beyond the last.
  std::optional<Motion> at(double time_s) {
    OdometerReading reading;
    while (is_more_ && read_to_s_ < time_s) {
      is_more_ = readings_.next(reading);
      if (!is_more_) break;
      odometer_.update(reading);
      read_to_s_ = reading.time_s;
    }
    const Motion motion = odometer_.at(time_s);
    if (!std::isfinite(motion.distance_m)) return std::nullopt;
    return motion;
  }

 private:
  static OdometerOptions options_of(double counts_per_m) {
    OdometerOptions options;
    options.counts_per_m = counts_per_m;
    return options;
  }

  CsvReader<OdometerReading> readings_;
  Odometer odometer_;
  double read_to_s_ = -std::numeric_limits<double>::infinity();
  bool is_more_ = true;
};

/// Whoever --to names: they hear of a head before its first scan.
class FollowSinks {
 public:
  FollowSinks(const std::vector<std::string>& addresses, const EventPort& events)
      : events_([this, events](const Event& event) {
          events.send(event);
          bus_.event(event);
        }),
        bus_(events_) {
    for (const SinkUri& uri : parse_sinks(addresses)) {
      bus_.add(uri.text(), open_sink(uri));
      has_any_ = true;
    }
  }

  const EventPort& events() const noexcept { return events_; }
  ScanBus& bus() noexcept { return bus_; }

  void write(const PolarScan& scan, ScanSource& source) {
    if (!has_any_) return;
    if (heads_.emplace(scan.head()).second) bus_.open(source.info_of(scan.head()));
    bus_.write(std::make_shared<const PolarScan>(scan));
  }

  void finish() {
    bus_.finish();
    if (bus_.failure()) std::rethrow_exception(bus_.failure());
  }

 private:
  EventPort events_;
  ScanBus bus_;
  bool has_any_ = false;
  std::set<std::string, std::less<>> heads_;
};

void refuse_what_says_nothing(const FollowArguments& arguments, const FollowCounts& counts) {
  if (counts.scans == 0)
    throw Error(ErrorKind::kBadFile, fmt::format("{} has no scans", arguments.scans));
  if (counts.without_motion == counts.scans)
    throw Error(ErrorKind::kBadFile,
                fmt::format("{} says nothing at the times of {}: expected both on one clock, "
                            "time_s in seconds",
                            arguments.odometer.value_or(""), arguments.scans));
}

}  // namespace

void require_files(const FollowArguments& arguments) {
  std::vector<std::string> read{SourceUri::parse(arguments.scans).path()};
  for (const auto& file : {arguments.model, arguments.odometer})
    if (file) read.push_back(*file);
  std::vector<std::string> written;
  for (const SinkUri& uri : parse_sinks(arguments.sinks)) written.push_back(uri.path());
  for (const auto& file : {arguments.output, arguments.plot})
    if (file) written.push_back(*file);
  require_own_files(read, written);
  require_plot_file("--plot", arguments.plot);
}

std::optional<double> FollowArguments::up_rad() const {
  return up_deg ? std::optional(*up_deg * kDegree) : std::nullopt;
}

std::optional<std::string> FollowArguments::table() const {
  if (output) return output;
  return json ? std::nullopt : std::optional<std::string>("-");
}

CommandOption* add_follow_arguments(Command& command, FollowArguments& arguments) {
  command
      .add_option("SCANS", arguments.scans,
                  "Scans: a recording (.csv, .jsonl, .mcap), or any source and --model")
      ->required();
  command
      .add_option("-m,--model", arguments.model, "The calibrated striper; for a source of frames")
      ->type_name("FILE");
  command
      .add_option("-o,--output", arguments.output,
                  "Where the table goes; default: the standard output, with --json nowhere")
      ->type_name("FILE");
  command
      .add_option("--to", arguments.sinks,
                  "Who else gets the scans and what is found in them: jsonl:FILE, mcap:FILE, "
                  "web:PORT, ros2:; as often as you like (csv:, ply: and the like take the scans "
                  "alone)")
      ->type_name("SINK")
      ->one_word_each();
  command.add_option("--plot", arguments.plot, "A plot of a scan, and of all there was")
      ->type_name("FILE.svg");
  command
      .add_option("--up", arguments.up_deg,
                  "The scan plane cuts the ground: the direction that points up, degrees from x to "
                  "y in the scan frame")
      ->type_name("DEG")
      ->check(between(-360.0, 360.0));
  auto* const odometer = command
                             .add_option("--odometer", arguments.odometer,
                                         "How the vehicle moves: a table time_s,counts and, if "
                                         "there is one, yaw_rate_rad_s")
                             ->type_name("FILE");
  auto* const counts =
      command
          .add_option("--counts-per-m", arguments.counts_per_m,
                      "Counts of the wheel in a metre; below 0 where it counts down forwards")
          ->type_name("K")
          ->check(not_zero())
          ->needs(odometer);
  odometer->needs(counts);
  command
      .add_option("--speed", arguments.speed_m_s,
                  "The vehicle's speed where there is no odometer, m/s: how far curbs are tracked; "
                  "default 5, 0 where it stands")
      ->type_name("V")
      ->check(between(0.0, 100.0))
      ->excludes(odometer);
  command.add_option("--frames", arguments.frames, "Stop after so many scans")
      ->type_name("N")
      ->check(above_zero());
  add_sigma_option(command, arguments.sigma_m);
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  return odometer;
}

FollowCounts follow_scans(const FollowArguments& arguments, const EventPort& events,
                          const std::function<void(const FollowedScan&)>& take) {
  FollowSinks sinks(arguments.sinks, events);
  std::shared_ptr<const StriperModel> model;
  if (arguments.model) {
    model = std::make_shared<StriperModel>(load_model(*arguments.model, sinks.events()));
  }
  const auto source = open_scans(arguments.scans, model, std::nullopt, sinks.events());
  std::optional<WheelMotion> wheel;
  if (arguments.odometer) wheel.emplace(*arguments.odometer, arguments.counts_per_m);
  Progress progress("scans", std::nullopt);
  FollowCounts counts;
  RangeSigmas sigmas(arguments.sigma_m);
  ScanPace pace;
  PolarScan scan;
  while (counts.scans < arguments.frames && !stop_requested()) {
    const NextStatus status = source->next(scan, std::chrono::milliseconds(100));
    if (status == NextStatus::kTimeout) continue;
    if (status != NextStatus::kFrame) break;
    sigmas.complete(scan);
    sigmas.require_any(arguments.scans);
    pace.add(scan);
    const auto motion = wheel ? wheel->at(scan.time.seconds()) : std::nullopt;
    counts.without_motion += wheel && !motion ? 1 : 0;
    sinks.write(scan, *source);
    take({scan, motion, sinks.bus(), sinks.events()});
    progress.update(++counts.scans);
  }
  sinks.finish();
  say_loss(*source);
  if (const std::string broken = pace.problem(); !broken.empty()) say(broken);
  refuse_what_says_nothing(arguments, counts);
  return counts;
}

void write_plot(const FollowArguments& arguments, const std::function<std::string()>& svg) {
  if (arguments.plot) write_plot_file(*arguments.plot, svg());
  if (arguments.output) say(fmt::format("wrote {}", *arguments.output));
}

}  // namespace striper::program
