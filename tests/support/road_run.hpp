// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include <striper/guidance/guidance.hpp>
#include <striper/road/road_drive.hpp>

namespace striper::testing {

/// What guidance said of a drive, with what was true.
struct RoadRun {
  struct Point {
    LateralLine line;
    double error_m = 0.0;    ///< NaN where nothing was said.
    bool has_paint = false;  ///< Of line 0, under the gun.
  };
  std::vector<Point> points;
  std::vector<GunLine> guns;
  std::vector<SeenLine> seen;
  std::vector<FaultLine> faults;
  GuidanceTotals totals;

  /// Errors in metres where there is paint under the gun, from a distance on.
  std::vector<double> errors_m(double from_m = 25.0) const {
    std::vector<double> errors;
    for (const Point& point : points) {
      if (point.has_paint && point.line.distance_m > from_m) errors.push_back(point.error_m);
    }
    return errors;
  }
  std::size_t count(SeenKind kind, const std::string& beam = "front") const {
    return static_cast<std::size_t>(std::count_if(seen.begin(), seen.end(), [&](const SeenLine& s) {
      return s.kind == kind && s.beam == beam;
    }));
  }
};

/// What may be done to the inputs on the way: changed, or (false) taken out.
struct RoadFaults {
  std::function<bool(BeamSweep&)> sweep = [](BeamSweep&) { return true; };
  std::function<bool(OdometerReading&)> odometer = [](OdometerReading&) { return true; };
};

/// Drives a road and guides. @param keeps_lines whether seen has a row for each line of each sweep
inline RoadRun guide_road(const Road& road, const GuidanceConfig& config,
                          const RoadFaults& faults = {}, bool paints = false) {
  struct Listener : GuidanceListener {
    Listener(RoadRun& to, RoadDrive& road) : run(to), drive(road) {}
    void lateral(const LateralLine& line) override {
      RoadRun::Point point{line, 0.0, false};
      const RoadTruth truth = drive.truth_at(drive.distance_at(line.time_s));
      point.error_m = line.lateral_m - truth.lateral_m;
      point.has_paint = truth.line0 != 0;
      run.points.push_back(point);
      last = line;
    }
    void gun(const GunLine& line) override { run.guns.push_back(line); }
    void seen(const SeenLine& line) override {
      if (line.kind != SeenKind::kLine) run.seen.push_back(line);
    }
    void fault(const FaultLine& line) override { run.faults.push_back(line); }
    RoadRun& run;
    RoadDrive& drive;
    LateralLine last;
  };
  RoadRun run;
  RoadDrive drive(road);
  Listener listener(run, drive);
  Guidance guidance(config, listener);
  BeamSweep sweep;
  OdometerReading reading;
  double painted_to_m = 0.0;
  while (true) {
    const RoadDrive::Next next = drive.next(sweep, reading);
    if (next == RoadDrive::Next::kEnd) break;
    if (next == RoadDrive::Next::kOdometer && faults.odometer(reading)) guidance.take(reading);
    if (next == RoadDrive::Next::kSweep && faults.sweep(sweep)) guidance.take(sweep);
    if (!paints || next != RoadDrive::Next::kSweep) continue;
    const double here_m = drive.distance_at(sweep.time_s);
    if (std::isfinite(listener.last.lateral_m))
      drive.paint(painted_to_m, here_m, listener.last.lateral_m);
    painted_to_m = here_m;
  }
  guidance.finish();
  run.totals = guidance.totals();
  return run;
}

inline double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

inline double share_within(const std::vector<double>& values, double limit) {
  const auto within =
      std::count_if(values.begin(), values.end(), [&](double v) { return std::abs(v) <= limit; });
  return static_cast<double>(within) / static_cast<double>(values.size());
}

}  // namespace striper::testing
