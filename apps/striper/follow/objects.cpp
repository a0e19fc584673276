// SPDX-License-Identifier: Apache-2.0
// striper objects: what stands or moves in the scan plane, how fast it closes, when it is here.
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/units.hpp>
#include <striper/detect/object_csv.hpp>
#include <striper/detect/objects.hpp>

#include "follow/follow_table.hpp"
#include "follow/found_tracks.hpp"
#include "follow/object_plot.hpp"
#include "follow/scan_following.hpp"
#include "options/option_bounds.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct ObjectsArguments {
  FollowArguments follow;
  double forward_deg = 0.0;
  std::optional<double> roughness_m;
  std::optional<double> acceleration_m_s2;
  double contact_s = 1.0;  // At 50 km/h 14 m, more than a striper sees.
};

constexpr const char* kDescription =
    "Follow objects in scans: where, how fast they close, time to contact, with error bars.";

constexpr const char* kHelp =
    "Each scan gives a line for each object that is tracked (scan frame, x forward and y left):\n"
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
    "                        inf: it may not close at all; empty: it certainly does not\n"
    "  zone                  road, behind_curb, or unknown: needs --up and a curb, which is\n"
    "                        tracked: it counts while somebody before it hides it, for\n"
    "                        5 m of way (--speed without --odometer)\n"
    "  confidence            the probability that it exists: rises when it is seen, falls when it\n"
    "                        should be and is not, stays while something nearer hides it\n\n"
    "Speeds are those within the scan plane. What goes through the plane, as a walker along the "
    "road\n"
    "does, shows another part of itself in every scan, and its outline seems to move.\n"
    "All of a stripe is exposed by one flash: unlike a turning scanner it has no skew in a "
    "scan.\n\n"
    "Examples:\n"
    "  striper objects drive.csv -o objects.csv\n"
    "  striper objects drive.csv --odometer odometer.csv --counts-per-m 1200 -o objects.csv\n"
    "      takes the own motion out; odometer.csv: time_s,counts,yaw_rate_rad_s\n"
    "  striper objects street.csv --up 118 -o objects.csv\n"
    "      the scan plane cuts the road: its returns are no objects, its curb divides the zones\n"
    "  striper objects lidar.csv --sigma 0.01 --json -o objects.csv\n"
    "      a table made elsewhere: frame,time_s,bearing_rad,range_m\n"
    "  striper objects street.csv --up 118 --contact 0.5 --to drive.mcap --plot objects.svg\n"
    "      a recording of scans and objects for Foxglove, and a plot\n\n"
    "Events (docs/events.md): object_found, object_lost, and contact_near where an object that is "
    "not\n"
    "behind a curb will be here within --contact; with --json, and to whoever --to names.";

void define(Command& command, ObjectsArguments& arguments) {
  CommandOption* const odometer = add_follow_arguments(command, arguments.follow);
  command
      .add_option("--forward", arguments.forward_deg,
                  "The way ahead in the scan frame, degrees from x to y; default 0")
      ->type_name("DEG")
      ->check(between(-360.0, 360.0))
      ->needs(odometer);
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
  command
      .add_option("--contact", arguments.contact_s,
                  "contact_near is said of what will be here sooner, seconds; default 1")
      ->type_name("S")
      ->check(between(0.0, 100.0));
  command.footer(kHelp);
}

// What one scan plane shows.
struct Plane {
  ObjectTracker tracker;
  std::optional<CurbDetector> street;  // Where the scan plane cuts a road.
  std::set<std::uint64_t> warned;      // Tracks of which contact_near was said.
};

struct ObjectsResult {
  std::uint64_t lines = 0;
  std::uint64_t objects = 0;  // That were certain at some time.
  double soonest_contact_s = kNone;
};

/// Tracks the objects of every scan, each head's and laser's by itself.
class ObjectsRun {
 public:
  explicit ObjectsRun(const ObjectsArguments& arguments)
      : arguments_(arguments), table_(arguments.follow.table(), object_columns()) {
    // What is told is not learnt.
    options_.learns = !arguments.roughness_m && !arguments.acceleration_m_s2;
    options_.roughness_m = arguments.roughness_m.value_or(options_.roughness_m);
    options_.acceleration_m_s2 = arguments.acceleration_m_s2.value_or(options_.acceleration_m_s2);

    options_.forward_rad = arguments.forward_deg * kDegree;
    if (arguments.follow.plot) plot_.emplace();
  }

  void look_at(const FollowedScan& followed) {
    table_.begin();
    const PolarScan& scan = followed.scan;
    const FoundTracks::Plane key(std::string(scan.head()), scan.laser);
    Plane& plane = plane_of(key);
    if (plane.street) {
      plane.street->update(scan, followed.motion);
      plane.tracker.set_street(*plane.street);
    }
    const auto tracks = plane.tracker.update(scan, followed.motion);
    ObjectsSeen seen(scan, tracks);
    write(seen);
    say(seen, plane, key, followed.events);
    if (plot_) plot_->add(scan, tracks);
    followed.bus.objects(std::move(seen));
  }

  const ObjectsResult& finish() {
    table_.close();
    result_.objects = found_.count();
    return result_;
  }

  std::string svg() const { return plot_->svg(); }

 private:
  Plane& plane_of(const FoundTracks::Plane& key) {
    const auto found = planes_.find(key);
    if (found != planes_.end()) return found->second;
    Plane plane{ObjectTracker(options_), std::nullopt, {}};
    if (const auto up_rad = arguments_.follow.up_rad()) {
      CurbDetectorOptions street;
      street.curb.up_rad = up_rad;
      street.speed_m_s = arguments_.follow.speed_m_s;
      plane.street.emplace(street);
    }
    return planes_.emplace(key, std::move(plane)).first->second;
  }

  void write(const ObjectsSeen& seen) {
    for (const ObjectLine& line : seen.lines) {
      table_.add(line);
      if (line.track.confidence < FoundTracks::kSure) continue;
      result_.soonest_contact_s =
          std::fmin(result_.soonest_contact_s, line.track.time_to_contact_s);
    }
    result_.lines += seen.lines.size();
    table_.flush();
  }

  void say(const ObjectsSeen& seen, Plane& plane, const FoundTracks::Plane& key,
           const EventPort& events) {
    const auto send = [&](Event event) {
      event.head = seen.scan.head;
      event.time_s = seen.scan.time.seconds();
      events.send(std::move(event));
    };
    for (const ObjectLine& line : seen.lines) {
      const ObjectTrack& track = line.track;
      if (found_.see(key, track.id, track.confidence)) {
        send({"object_found", fmt::format("object {} at {:.2f} m, {:.2f} m wide", track.id,
                                          line.range_m, track.width_m)});
      }
      if (is_near(track) && plane.warned.insert(track.id).second) {
        send({"contact_near", fmt::format("object {} at {:.2f} m will be here in {:.2f} s",
                                          track.id, line.range_m, track.time_to_contact_s)});
      }
    }
    found_.forget_unseen(key, [&](std::uint64_t track) {
      plane.warned.erase(track);
      send({"object_lost", fmt::format("object {} is not tracked any more", track)});
    });
  }

  // Somebody on the pavement is no reason for an alarm.
  bool is_near(const ObjectTrack& track) const {
    return track.confidence >= FoundTracks::kSure && track.zone != ObjectZone::kBehindCurb &&
           track.time_to_contact_s <= arguments_.contact_s;
  }

  const ObjectsArguments& arguments_;
  ObjectOptions options_;
  FollowTable<ObjectLine> table_;
  std::optional<ObjectPlot> plot_;
  std::map<FoundTracks::Plane, Plane> planes_;
  FoundTracks found_;
  ObjectsResult result_;
};

nlohmann::json json_of(const FollowCounts& counts, const ObjectsResult& result,
                       const TerminalEvents& events) {
  nlohmann::json json{{"scans", counts.scans},
                      {"lines", result.lines},
                      {"objects", result.objects},
                      {"scans_without_motion", counts.without_motion},
                      {"events", to_json(events.heard())}};
  json["soonest_contact_s"] = nullptr;
  if (std::isfinite(result.soonest_contact_s)) json["soonest_contact_s"] = result.soonest_contact_s;
  return json;
}

ExitCode objects(const ObjectsArguments& arguments) {
  const TerminalEvents events;
  require_files(arguments.follow);
  ObjectsRun run(arguments);
  const FollowCounts counts =
      follow_scans(arguments.follow, events.port(),
                   [&](const FollowedScan& followed) { run.look_at(followed); });
  const ObjectsResult& result = run.finish();
  say(fmt::format("tracked {} in {}", count(result.objects, "object"),
                  count(counts.scans, "scan")));
  if (std::isfinite(result.soonest_contact_s))
    say(fmt::format("soonest contact {:.2g} s ahead", result.soonest_contact_s));
  write_plot(arguments.follow, [&] { return run.svg(); });
  if (arguments.follow.json) print_json(json_of(counts, result, events));
  return ExitCode::kDone;
}

}  // namespace

void add_objects(Command& striper, Action& action) {
  add_command<ObjectsArguments>(striper, action, "objects", kDescription, define, objects);
}

}  // namespace striper::program
