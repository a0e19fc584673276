// SPDX-License-Identifier: Apache-2.0
// striper curb: where the road ends, how high that is, how sure it is a curb.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/detect/curb_csv.hpp>
#include <striper/detect/curb_detector.hpp>

#include "follow/curb_plot.hpp"
#include "follow/follow_table.hpp"
#include "follow/found_tracks.hpp"
#include "follow/scan_following.hpp"
#include "options/option_bounds.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct CurbArguments {
  FollowArguments follow;
  double min_height_m = CurbOptions{}.min_height_m;
  double max_height_m = CurbOptions{}.max_height_m;
};

constexpr const char* kDescription =
    "Find curbs in scans across the road and follow them: place, height, error bars, probability.";

constexpr const char* kHelp =
    "Each scan gives a line for each curb or ramp that is tracked:\n"
    "frame,time_s,head,laser,track,kind,state,foot_x_m,foot_y_m,top_x_m,top_y_m,lateral_m,\n"
    "sigma_lateral_m,sigma_cal_lateral_m,height_m,sigma_height_m,sigma_cal_height_m,confidence\n"
    "  track              the same number while it is the same curb\n"
    "  kind               up, down (the road ends and goes on lower) or ramp, which is no curb\n"
    "  state              new, tracked, or hidden: something is before it; it is predicted then\n"
    "  foot, top          where the road's line meets the face's, and the face's meets the top's\n"
    "                     (scan frame); of kind down the foot is the last of the road that is "
    "seen\n"
    "  lateral_m          of the foot along the road, from the point below the sensor; positive "
    "to\n"
    "                     +x of the scan frame where the stripe runs along rows, else +y\n"
    "  height_m           of the edge over the road's line\n"
    "  sigma_...          one sigma, random error; sigma_cal_... the calibration's, common to all\n"
    "                     scans: it needs a model with a covariance (--model, or in the "
    "recording)\n"
    "  confidence         the probability that it is a curb, up or down: what stands on the road\n"
    "                     ends within a metre or two of way, a curb does not\n\n"
    "Examples:\n"
    "  striper curb drive.csv -o curbs.csv\n"
    "      without an odometer the vehicle is taken to go 5 m/s (--speed)\n"
    "  striper curb drive.mcap --odometer odometer.csv --counts-per-m 1200 -o curbs.csv\n"
    "  striper curb gige:STRIPER1 -m striper.yaml --up 118 --json -o curbs.csv\n"
    "      live; 118 degrees in the scan frame are up, within 20\n"
    "  striper curb drive.csv -o curbs.csv --plot curbs.svg --to drive.mcap\n"
    "      a plot, and a recording of scans and curbs for Foxglove\n\n"
    "Events (docs/events.md): curb_found, curb_lost; with --json, and to whoever --to names.";

void define(Command& command, CurbArguments& arguments) {
  add_follow_arguments(command, arguments.follow);
  command
      .add_option("--min-height", arguments.min_height_m, "Lower is no curb, metres; default 0.03")
      ->type_name("M")
      ->check(between(1e-3, 1.0));
  command
      .add_option("--max-height", arguments.max_height_m,
                  "Higher is a wall or a vehicle, metres; default 0.3 (down may be any deeper)")
      ->type_name("M")
      ->check(between(1e-3, 1.0));
  command.footer(kHelp);
}

struct CurbResult {
  std::uint64_t lines = 0;
  std::uint64_t curbs = 0;       // That were found.
  std::uint64_t sure_scans = 0;  // That had one.
  std::uint64_t without_road = 0;
  double best = 0.0;  // Confidence.
};

/// Tracks the curbs of every scan, each head's and laser's by itself.
class CurbRun {
 public:
  explicit CurbRun(const CurbArguments& arguments)
      : table_(arguments.follow.table(), curb_columns()) {
    options_.curb.up_rad = arguments.follow.up_rad();
    options_.curb.min_height_m = arguments.min_height_m;
    options_.curb.max_height_m = arguments.max_height_m;
    options_.speed_m_s = arguments.follow.speed_m_s;
    options_.validate();
    if (arguments.follow.plot) plot_.emplace();
  }

  void look_at(const FollowedScan& followed) {
    table_.begin();
    const PolarScan& scan = followed.scan;
    const FoundTracks::Plane plane(std::string(scan.head()), scan.laser);
    CurbDetector& detector = detectors_.try_emplace(plane, options_).first->second;
    const auto tracks = detector.update(scan, followed.motion);
    CurbsSeen seen(scan, tracks);
    write(seen);
    say(seen, plane, followed.events);
    if (plot_) plot_->add(scan, detector.view(), tracks, way_m(followed));
    followed.bus.curbs(std::move(seen));
    result_.without_road += detector.view().has_road ? 0 : 1;
  }

  const CurbResult& finish() {
    table_.close();
    result_.curbs = found_.count();
    return result_;
  }

  std::string svg() const { return plot_->svg(); }

 private:
  void write(const CurbsSeen& seen) {
    double best = 0.0;
    for (const CurbLine& line : seen.lines) {
      table_.add(line);
      best = std::max(best, line.track.confidence);
    }
    result_.lines += seen.lines.size();
    result_.best = std::max(result_.best, best);
    result_.sure_scans += best >= FoundTracks::kSure ? 1 : 0;
    table_.flush();
  }

  void say(const CurbsSeen& seen, const FoundTracks::Plane& plane, const EventPort& events) {
    const auto send = [&](Event event) {
      event.head = seen.scan.head;
      event.time_s = seen.scan.time.seconds();
      events.send(std::move(event));
    };
    for (const CurbLine& line : seen.lines) {
      const CurbTrack& track = line.track;
      if (!found_.see(plane, track.id, track.confidence)) continue;
      send({"curb_found", fmt::format("curb {} ({}) at {:.3f} m, {:.3f} m high", track.id,
                                      to_string(track.kind), track.lateral_m, track.height_m)});
    }
    found_.forget_unseen(plane, [&](std::uint64_t track) {
      send({"curb_lost", fmt::format("curb {} is not tracked any more", track)});
    });
  }

  // Of the vehicle since the first scan.
  double way_m(const FollowedScan& followed) {
    const double time_s = followed.scan.time.seconds();
    const double now = followed.motion ? followed.motion->distance_m : options_.speed_m_s * time_s;
    if (!start_m_) start_m_ = now;
    return now - *start_m_;
  }

  CurbDetectorOptions options_;
  FollowTable<CurbLine> table_;
  std::optional<CurbPlot> plot_;
  std::map<FoundTracks::Plane, CurbDetector> detectors_;
  FoundTracks found_;
  std::optional<double> start_m_;
  CurbResult result_;
};

nlohmann::json json_of(const FollowCounts& counts, const CurbResult& result,
                       const TerminalEvents& events) {
  return {{"scans", counts.scans},
          {"lines", result.lines},
          {"curbs", result.curbs},
          {"scans_with_a_curb", result.sure_scans},
          {"scans_without_road", result.without_road},
          {"scans_without_motion", counts.without_motion},
          {"events", to_json(events.heard())}};
}

ExitCode curb(const CurbArguments& arguments) {
  const TerminalEvents events;
  require_files(arguments.follow);
  CurbRun run(arguments);
  const FollowCounts counts =
      follow_scans(arguments.follow, events.port(),
                   [&](const FollowedScan& followed) { run.look_at(followed); });
  const CurbResult& result = run.finish();
  say(fmt::format("{} in {}; a curb is seen in {}", count(result.curbs, "curb"),
                  count(counts.scans, "scan"), result.sure_scans));
  if (result.curbs == 0 && result.best > 0.5) {
    say(fmt::format(
        "what may be one is one with probability {:.2f}: a curb shows by that it goes on "
        "along the way",
        result.best));
  }
  if (result.without_road > 0) {
    say(fmt::format("{} of them show no road{}", result.without_road,
                    arguments.follow.up_deg ? " within 20 degrees of --up" : ""));
  }
  write_plot(arguments.follow, [&] { return run.svg(); });
  if (arguments.follow.json) print_json(json_of(counts, result, events));
  return ExitCode::kDone;
}

}  // namespace

void add_curb(Command& striper, Action& action) {
  add_command<CurbArguments>(striper, action, "curb", kDescription, define, curb);
}

}  // namespace striper::program
