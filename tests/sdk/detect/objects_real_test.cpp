// SPDX-License-Identifier: Apache-2.0
// Proves, on recordings of a turning lidar with motion capture beside it, that the closing speed of
// a real vehicle is found with true error bars and that it stays the same object. Not a striper's
// scans: coarser (1 degree), noisier (40 mm), at 12.5 Hz, from a model vehicle that turns itself.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/csv_table.hpp>
#include <striper/core/robust.hpp>
#include <striper/detect/objects.hpp>
#include <striper/scan/scan_csv.hpp>

#include "support/shared_data.hpp"

namespace striper {
namespace {

using Eigen::Vector2d;

// The lidar's own noise; what the vehicle's outline is off a box by; how a model vehicle that
// swerves at 12.5 Hz accelerates. Chosen on these recordings.
constexpr double kSigma_m = 0.01;
constexpr double kRoughness_m = 0.01;
constexpr double kAcceleration_m_s2 = 3.0;

struct TruthLine {
  std::string who;
  double time_s = 0.0, x_m = 0.0, y_m = 0.0, yaw_rad = 0.0;
};

constexpr std::array kTruthColumns{
    csv_column<TruthLine>(
        "who", [](auto& r) -> auto& { return r.who; }, CsvNeed::kRequired),
    csv_column<TruthLine>(
        "time_s", [](auto& r) -> auto& { return r.time_s; }, CsvNeed::kRequired),
    csv_column<TruthLine>(
        "x_m", [](auto& r) -> auto& { return r.x_m; }, CsvNeed::kRequired),
    csv_column<TruthLine>(
        "y_m", [](auto& r) -> auto& { return r.y_m; }, CsvNeed::kRequired),
    csv_column<TruthLine>(
        "yaw_rad", [](auto& r) -> auto& { return r.yaw_rad; }, CsvNeed::kRequired),
};

/// Where a vehicle was, by motion capture.
class TruthPath {
 public:
  void add(const TruthLine& line) { lines_.push_back(line); }
  double from_s() const { return lines_.front().time_s; }
  double to_s() const { return lines_.back().time_s; }
  TruthLine at(double time_s) const {
    const auto after =
        std::lower_bound(lines_.begin() + 1, lines_.end() - 1, time_s,
                         [](const TruthLine& line, double time) { return line.time_s < time; });
    const TruthLine& a = *(after - 1);
    const TruthLine& b = *after;
    const double part = std::clamp((time_s - a.time_s) / (b.time_s - a.time_s), 0.0, 1.0);
    TruthLine at = a;
    at.x_m += part * (b.x_m - a.x_m);
    at.y_m += part * (b.y_m - a.y_m);
    at.yaw_rad += part * std::remainder(b.yaw_rad - a.yaw_rad, 2.0 * std::numbers::pi);
    return at;
  }

 private:
  std::vector<TruthLine> lines_;
};

struct Recording {
  TruthPath ego, red;
  std::vector<PolarScan> scans;
};

Recording load(const std::string& name, double sigma_m) {
  const auto folder = testing::real_data("datmo-moving-objects");
  Recording recording;
  CsvReader<TruthLine> truth(
      CsvInput::of_text("truth", testing::unpacked(folder / ("datmo_" + name + "_truth.csv.gz"))),
      kTruthColumns, "a table of poses");
  TruthLine line;
  while (truth.next(line)) (line.who == "ego" ? recording.ego : recording.red).add(line);
  std::string text = testing::unpacked(folder / ("datmo_" + name + "_scans.csv.gz"));
  text.replace(0, 4, "frame");  // Their word is `scan`.
  ScanCsvOptions options;
  options.sigma_m = sigma_m;
  ScanCsvReader reader(CsvInput::of_text("scans", text), options);
  PolarScan scan;
  while (reader.next(scan)) recording.scans.push_back(scan);
  return recording;
}

/// The other vehicle as the ego vehicle's lidar sees it.
struct Relative {
  Vector2d closest_m;
  double closing_m_s;
};

// The vehicle's outline and where the lidar is on the other one, fitted to all returns of the three
// recordings: they are not in the files. Residual of the outline .01 m.
constexpr double kLidar_m = -0.148;  // Behind the middle.
constexpr double kHalfLength_m = 0.15;
constexpr double kHalfWidth_m = 0.095;

/// From the lidar, in its frame, to the middle of the other vehicle.
Vector2d centre_at(const Recording& r, double time_s) {
  const TruthLine a = r.ego.at(time_s);
  const TruthLine b = r.red.at(time_s);
  const Vector2d between(b.x_m - a.x_m, b.y_m - a.y_m);
  return Eigen::Rotation2Dd(-a.yaw_rad) * between - Vector2d(kLidar_m, 0.0);
}

/// Of the other vehicle's outline the point that is closest to the lidar, in the lidar's frame.
Vector2d closest_at(const Recording& r, double time_s) {
  const Eigen::Rotation2Dd turn(r.red.at(time_s).yaw_rad - r.ego.at(time_s).yaw_rad);
  const Vector2d centre = centre_at(r, time_s);
  const Vector2d half(kHalfLength_m, kHalfWidth_m);
  const Vector2d lidar = turn.inverse() * -centre;
  return centre + turn * Vector2d(lidar.cwiseMin(half).cwiseMax(-half));
}

Relative relative_at(const Recording& r, double time_s) {
  constexpr double kStep_s = 0.04;
  const double before = closest_at(r, time_s - kStep_s).norm();
  const double after = closest_at(r, time_s + kStep_s).norm();
  return {closest_at(r, time_s), (before - after) / (2.0 * kStep_s)};
}

/// How well the other vehicle was tracked.
struct Closing {
  std::vector<double> errors;  // Absolute, m/s, from the third scan of a track on.
  std::vector<double> pulls;
  std::set<std::uint64_t> ids;
  int scans = 0;  // It was seen in.

  double robust_rms() { return robust_sigma(errors); }
  double pull() const {
    double sum = 0.0;
    for (const double pull : pulls) sum += pull * pull;
    return std::sqrt(sum / static_cast<double>(pulls.size()));
  }
};

const ObjectTrack* nearest_to(const Vector2d& point, std::span<const ObjectTrack> tracks) {
  const ObjectTrack* nearest = nullptr;
  double least = 0.2;  // The vehicle is .19 m wide.
  for (const ObjectTrack& t : tracks) {
    const double off = (t.position_m - point).norm();
    if (!t.is_seen || off >= least) continue;
    least = off;
    nearest = &t;
  }
  return nearest;
}

Closing follow(const std::string& name, const ObjectOptions& options) {
  const Recording recording = load(name, kSigma_m);
  ObjectTracker tracker(options);
  Closing closing;
  for (const PolarScan& scan : recording.scans) {
    const auto tracks = tracker.update(scan);
    const double time = scan.time.seconds();
    if (time < recording.ego.from_s() + 0.05 || time > recording.ego.to_s() - 0.05) continue;
    const Relative truth = relative_at(recording, time);
    const ObjectTrack* other = nearest_to(truth.closest_m, tracks);
    if (other == nullptr) continue;
    ++closing.scans;
    closing.ids.insert(other->id);
    if (other->hits < 3) continue;
    const double error = other->closing_m_s - truth.closing_m_s;
    closing.errors.push_back(std::abs(error));
    closing.pulls.push_back(std::abs(error) / other->sigma_closing_m_s);
  }
  return closing;
}

struct Bounds {
  int scans;
  double robust_rms;
  double most_pull;
  std::size_t tracks;
};

void expect_followed(const std::string& name, const ObjectOptions& options, const Bounds& bounds) {
  Closing closing = follow(name, options);
  const auto what = ::testing::Message() << name << ": " << closing.robust_rms() << " m/s, pull "
                                         << closing.pull() << ", " << closing.scans << " scans";
  EXPECT_GE(closing.scans, bounds.scans) << what;
  EXPECT_LE(closing.robust_rms(), bounds.robust_rms) << what;
  EXPECT_GE(closing.pull(), 0.8) << what;
  EXPECT_LE(closing.pull(), bounds.most_pull) << what;
  EXPECT_LE(closing.ids.size(), bounds.tracks) << what;
}

ObjectOptions told() {
  ObjectOptions options;
  options.roughness_m = kRoughness_m;
  options.acceleration_m_s2 = kAcceleration_m_s2;
  options.learns = false;
  return options;
}

// Two-scan differences and a constant-velocity filter on the closest return come to .07 and .10.
TEST(ObjectsReal, OvertakingVehiclesStayOneAndTheirSpeedIsTrue) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("datmo-moving-objects");
  expect_followed("overtakes", told(), {330, 0.060, 1.3, 1});
}

// ... to .06 and .07.
TEST(ObjectsReal, AnOvertakenVehicleStaysOneAndItsSpeedIsTrue) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("datmo-moving-objects");
  expect_followed("overtake_ego", told(), {110, 0.060, 1.3, 1});
}

// ... to .46 and .44; it is in view for 20 scans.
TEST(ObjectsReal, AVehicleAtACrossingStaysOneAndItsSpeedIsTrue) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("datmo-moving-objects");
  expect_followed("intersection", told(), {17, 0.30, 1.3, 1});
}

// Nobody says how rough and how restless: the error bars are too small by up to 1.8, at the
// crossing by 3.5, for 20 scans are too few to learn from.
TEST(ObjectsReal, WhatTheOptionsDoNotSayIsLearnt) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("datmo-moving-objects");
  expect_followed("overtakes", {}, {330, 0.070, 1.8, 2});
  expect_followed("overtake_ego", {}, {110, 0.060, 1.8, 1});
  expect_followed("intersection", {}, {17, 0.30, 3.5, 1});
}

}  // namespace
}  // namespace striper
