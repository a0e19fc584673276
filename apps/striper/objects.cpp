// SPDX-License-Identifier: Apache-2.0
// striper objects: what stands or moves in the scan plane, how fast it closes, when it is here.
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/detect/object_csv.hpp>
#include <striper/detect/objects.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/motion/odometer.hpp>
#include <striper/motion/odometer_csv.hpp>
#include <striper/scans/open_scans.hpp>

#include "option_bounds.hpp"
#include "program.hpp"
#include "summary.hpp"
#include "terminal.hpp"
#include "terminal_events.hpp"

namespace striper::program {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct ObjectsArguments {
  std::string scans;
  std::optional<std::string> model;
  std::optional<std::string> output;
  std::uint64_t frames = std::numeric_limits<std::uint64_t>::max();
  double sigma_m = kNone;
  std::optional<double> up_deg;
  double forward_deg = 0.0;
  std::optional<double> roughness_m;
  std::optional<double> acceleration_m_s2;
  std::optional<std::string> odometer;
  double counts_per_m = kNone;
  bool json = false;
};

constexpr const char* kDescription =
    "Follow objects in scans: where, how fast they close, time to contact, with error bars.";

constexpr const char* kHelp =
    "Each scan gives a line for each object that is followed (scan frame, x forward and y left):\n"
    "frame,time_s,head,laser,track,x_m,y_m,sigma_x_m,sigma_y_m,corr_xy,bearing_rad,range_m,\n"
    "width_m,vx_m_s,vy_m_s,sigma_v_m_s,observable_rad,closing_m_s,time_to_contact_s,ttc_low_s,\n"
    "ttc_high_s,zone,confidence\n"
    "  track                 the same number while it is the same object\n"
    "  x_m, y_m, range_m     its closest point; width_m of what is visible of it\n"
    "  vx_m_s, vy_m_s        over ground with --odometer, else relative to the sensor; from the\n"
    "                        second scan on. Along a wall no motion can be seen: where not both\n"
    "                        ends of an object are in view it is the part along observable_rad\n"
    "  sigma_v_m_s           one sigma of the velocity along observable_rad, where it is known "
    "best\n"
    "  closing_m_s           how fast its distance shrinks, always relative\n"
    "  time_to_contact_s     distance over closing speed, 95 % between ttc_low_s and ttc_high_s;\n"
    "                        inf: it may not close at all; empty: it surely does not\n"
    "  zone                  road, behind_curb, or unknown: needs --up and a curb in the scan\n"
    "  confidence            the probability that it exists: rises when it is seen, falls when it\n"
    "                        should be and is not, stays while something nearer hides it\n\n"
    "All of a stripe is exposed by one flash: unlike a turning scanner it has no skew in a "
    "scan.\n\n"
    "Examples:\n"
    "  striper objects drive.csv -o objects.csv\n"
    "  striper objects drive.csv --odometer odometer.csv --counts-per-m 1200 -o objects.csv\n"
    "      takes the own motion out; odometer.csv: time_s,counts,yaw_rate_rad_s\n"
    "  striper objects street.csv --up 118 -o objects.csv\n"
    "      the scan plane cuts the road: its returns are no objects, its curb divides the zones\n"
    "  striper objects lidar.csv --sigma 0.01 --json -o objects.csv\n"
    "      a table made elsewhere: frame,time_s,bearing_rad,range_m";

void define_motion(CLI::App& command, ObjectsArguments& arguments) {
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
          ->needs(odometer);
  odometer->needs(counts);
  command
      .add_option("--forward", arguments.forward_deg,
                  "The way ahead in the scan frame, degrees from x to y; default 0")
      ->type_name("DEG")
      ->check(between(-360.0, 360.0))
      ->needs(odometer);
}

void define_objects(CLI::App& command, ObjectsArguments& arguments) {
  command
      .add_option("--roughness", arguments.roughness_m,
                  "How far faces are from straight beyond the ranges' own errors, one sigma, "
                  "metres; without it learnt")
      ->type_name("M")
      ->check(between(0.0, 1.0));
  command
      .add_option("--acceleration", arguments.acceleration_m_s2,
                  "What objects accelerate by from scan to scan while nothing shows that they do, "
                  "one sigma, m/s^2; 3 for what swerves all the time; without it learnt")
      ->type_name("A")
      ->check(between(1e-3, 10.0));
}

void define(CLI::App& command, ObjectsArguments& arguments) {
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
      .add_option("--up", arguments.up_deg,
                  "The scan plane cuts the ground: the direction that points up, degrees from x to "
                  "y in the scan frame")
      ->type_name("DEG")
      ->check(between(-360.0, 360.0));
  define_motion(command, arguments);
  define_objects(command, arguments);
  command.add_option("--frames", arguments.frames, "Stop after so many scans")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command.add_option("--sigma", arguments.sigma_m, "Error of ranges that come without one, metres")
      ->type_name("M")
      ->check(between(1e-6, 1.0));
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  command.footer(kHelp);
}

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

// What one scan plane shows.
struct Plane {
  ObjectTracker tracker;
  std::optional<CurbFinder> ground;
};

struct ObjectsResult {
  std::uint64_t scans = 0;
  std::uint64_t lines = 0;
  std::uint64_t without_sigma = 0;   // Scans of which no return says how good it is.
  std::uint64_t without_motion = 0;  // Scans of which the odometer says nothing.
  std::uint64_t objects = 0;         // That were surely there at some time.
  double soonest_contact_s = kNone;
};

// More surely there than not by far: the second hit in a row makes .66, the third .90.
constexpr double kSure = 0.9;

/// Follows the objects of every scan, each head's and laser's by itself.
class ObjectsRun {
 public:
  explicit ObjectsRun(const ObjectsArguments& arguments) : arguments_(arguments) {
    // What is told is not learnt.
    options_.learns = !arguments.roughness_m && !arguments.acceleration_m_s2;
    options_.roughness_m = arguments.roughness_m.value_or(options_.roughness_m);
    options_.acceleration_m_s2 = arguments.acceleration_m_s2.value_or(options_.acceleration_m_s2);

    options_.forward_rad = arguments.forward_deg * kDegree;
    if (arguments.odometer) motion_.emplace(*arguments.odometer, arguments.counts_per_m);
    if (arguments.output || !arguments.json)
      table_.emplace(arguments.output.value_or("-"), object_columns());
  }

  void look_at(PolarScan& scan) {
    complete(scan);
    Plane& plane = plane_of(scan);
    if (plane.ground) plane.tracker.set_ground(&plane.ground->find(scan));
    std::optional<Motion> motion;
    if (motion_) motion = motion_->at(scan.time.seconds());
    result_.without_motion += motion_ && !motion ? 1 : 0;
    write(scan, plane.tracker.update(scan, motion));
    ++result_.scans;
  }

  const ObjectsResult& finish() {
    if (table_) table_->close();
    result_.objects = sure_.size();
    return result_;
  }

 private:
  using Key = std::pair<std::string, int>;

  void complete(PolarScan& scan) {
    bool is_any = false;
    bool is_known = false;
    for (Return& r : scan.returns) {
      if (!std::isfinite(r.sigma_m)) r.sigma_m = arguments_.sigma_m;
      is_any = is_any || std::isfinite(r.range_m);
      is_known = is_known || std::isfinite(r.sigma_m);
    }
    result_.without_sigma += is_any && !is_known ? 1 : 0;
  }

  Plane& plane_of(const PolarScan& scan) {
    const Key key(std::string(scan.head()), scan.laser);
    const auto found = planes_.find(key);
    if (found != planes_.end()) return found->second;
    Plane plane{ObjectTracker(options_), std::nullopt};
    if (arguments_.up_deg) {
      CurbOptions curbs;
      curbs.up_rad = *arguments_.up_deg * kDegree;
      plane.ground.emplace(curbs);
    }
    return planes_.emplace(key, std::move(plane)).first->second;
  }

  void write(const PolarScan& scan, std::span<const ObjectTrack> tracks) {
    line_.frame = scan.sequence;
    line_.time_s = scan.time.seconds();
    line_.head = scan.head();
    line_.laser = scan.laser;
    for (const ObjectTrack& track : tracks) {
      line_.set(track);
      if (table_) table_->add(line_);
      ++result_.lines;
      if (track.confidence < kSure) continue;
      sure_[{{line_.head, line_.laser}, track.id}] = true;
      result_.soonest_contact_s = std::fmin(result_.soonest_contact_s, track.time_to_contact_s);
    }
    if (table_) table_->flush();
  }

  const ObjectsArguments& arguments_;
  ObjectOptions options_;
  std::optional<WheelMotion> motion_;
  std::optional<CsvWriter<ObjectLine>> table_;
  std::map<Key, Plane> planes_;
  std::map<std::pair<Key, std::uint64_t>, bool> sure_;
  ObjectLine line_;
  ObjectsResult result_;
};

void follow(ScanSource& source, std::uint64_t most, ObjectsRun& run) {
  Progress progress("scans", std::nullopt);
  PolarScan scan;
  for (std::uint64_t scans = 0; scans < most && !stop_requested();) {
    const NextStatus status = source.next(scan, std::chrono::milliseconds(100));
    if (status == NextStatus::kTimeout) continue;
    if (status != NextStatus::kFrame) break;
    run.look_at(scan);
    progress.update(++scans);
  }
}

void refuse_what_says_nothing(const ObjectsArguments& arguments, const ObjectsResult& result) {
  if (result.scans == 0)
    throw Error(ErrorKind::kBadFile, fmt::format("{} has no scans", arguments.scans));
  if (result.without_sigma == result.scans)
    throw Error(ErrorKind::kUsage,
                fmt::format("the ranges of {} come without sigma_m, so no error bar can be told: "
                            "say how good they are by --sigma M, metres",
                            arguments.scans));
  if (result.without_motion == result.scans)
    throw Error(ErrorKind::kBadFile,
                fmt::format("{} says nothing at the times of {}: expected both on one clock, "
                            "time_s in seconds",
                            arguments.odometer.value_or(""), arguments.scans));
}

nlohmann::json json_of(const ObjectsResult& result, const TerminalEvents& events) {
  nlohmann::json json{{"scans", result.scans},
                      {"lines", result.lines},
                      {"objects", result.objects},
                      {"scans_without_motion", result.without_motion},
                      {"events", to_json(events.heard())}};
  json["soonest_contact_s"] = nullptr;
  if (std::isfinite(result.soonest_contact_s)) json["soonest_contact_s"] = result.soonest_contact_s;
  return json;
}

ExitCode objects(const ObjectsArguments& arguments) {
  const TerminalEvents events;
  std::shared_ptr<const StriperModel> model;
  if (arguments.model)
    model = std::make_shared<StriperModel>(load_model(*arguments.model, events.port()));
  const auto source = open_scans(arguments.scans, model, std::nullopt, events.port());
  ObjectsRun run(arguments);
  follow(*source, arguments.frames, run);
  const ObjectsResult& result = run.finish();
  refuse_what_says_nothing(arguments, result);
  say(fmt::format("followed {} in {}", count(result.objects, "object"),
                  count(result.scans, "scan")));
  if (std::isfinite(result.soonest_contact_s))
    say(fmt::format("soonest contact {:.2g} s ahead", result.soonest_contact_s));
  if (arguments.output) say(fmt::format("wrote {}", *arguments.output));
  if (arguments.json) print_json(json_of(result, events));
  return ExitCode::kDone;
}

}  // namespace

void add_objects(CLI::App& striper, Action& action) {
  add_command<ObjectsArguments>(striper, action, "objects", kDescription, define, objects);
}

}  // namespace striper::program
