// SPDX-License-Identifier: Apache-2.0
// Proves guidance on what real lasers saw of real paint, from scan to followed line: two
// retroreflective tapes under a small ranger that turns (triangulation, as a striper), and a broken
// line on a street under the rings of a lidar on a moving car. Not a paint truck's beams: coarser,
// noisier, and without another measurement of where the paint is.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <striper/core/csv_table.hpp>
#include <striper/core/robust.hpp>
#include <striper/guidance/guidance.hpp>
#include <striper/guidance/paint_finder.hpp>
#include <striper/guidance/scan_sweep.hpp>

#include "support/shared_data.hpp"

namespace striper {
namespace {

// A scan's points, as both tables have them.
struct Spot {
  int scan = 0;
  int ring = 0;
  double bearing_deg = 0.0, range_m = 0.0;
  double x_m = 0.0, y_m = 0.0;
  double intensity = 0.0;
};

constexpr std::array kTapeColumns{
    csv_column<Spot>(
        "scan", [](auto& r) -> auto& { return r.scan; }, CsvNeed::kRequired),
    csv_column<Spot>(
        "bearing_deg", [](auto& r) -> auto& { return r.bearing_deg; }, CsvNeed::kRequired),
    csv_column<Spot>(
        "range_m", [](auto& r) -> auto& { return r.range_m; }, CsvNeed::kRequired),
    csv_column<Spot>(
        "intensity", [](auto& r) -> auto& { return r.intensity; }, CsvNeed::kRequired)};

constexpr std::array kStreetColumns{
    csv_column<Spot>(
        "frame", [](auto& r) -> auto& { return r.scan; }, CsvNeed::kRequired),
    csv_column<Spot>(
        "ring", [](auto& r) -> auto& { return r.ring; }, CsvNeed::kRequired),
    csv_column<Spot>(
        "x_m", [](auto& r) -> auto& { return r.x_m; }, CsvNeed::kRequired),
    csv_column<Spot>(
        "y_m", [](auto& r) -> auto& { return r.y_m; }, CsvNeed::kRequired),
    csv_column<Spot>(
        "reflectance", [](auto& r) -> auto& { return r.intensity; }, CsvNeed::kRequired)};

using Key = std::pair<int, int>;  // Scan and ring.

template <std::size_t kColumns>
std::map<Key, std::vector<Spot>> read_spots(const std::filesystem::path& path,
                                            const std::array<CsvColumn<Spot>, kColumns>& columns) {
  CsvReader<Spot> reader(CsvInput::of_text(path.string(), testing::unpacked(path)), columns,
                         "table of points");
  std::map<Key, std::vector<Spot>> spots;
  for (Spot spot; reader.next(spot);) spots[{spot.scan, spot.ring}].push_back(spot);
  return spots;
}

PolarScan scan_of(const std::vector<Spot>& spots) {
  PolarScan scan;
  for (const Spot& spot : spots) {
    Return point;
    point.status = ReturnStatus::kOk;
    point.x_m = spot.x_m;
    point.y_m = spot.y_m;
    point.intensity_dn = static_cast<float>(spot.intensity);
    scan.returns.push_back(point);
  }
  return scan;
}

// One beam that crosses the road at the gun, or nearly: its path is where it sees the line.
GuidanceConfig one_beam(double left_m, double right_m, int samples) {
  GuidanceConfig config;
  GuidanceBeam beam;
  beam.name = "beam";
  beam.x_m = 0.001;
  beam.y_left_m = left_m;
  beam.y_right_m = right_m;
  beam.samples = samples;
  config.beams = {beam};
  config.odometer.counts_per_m = 1000.0;
  config.guns = {GuidanceGun{}};
  return config;
}

struct SeenLines : GuidanceListener {
  void seen(const SeenLine& line) override { lines.push_back(line); }
  std::vector<SeenLine> lines;
};

// Guides along what a scan saw here, another there, at a metre a second.
class WayAlong {
 public:
  explicit WayAlong(const GuidanceConfig& config) : guidance_(config, listener_) {}

  void take(const std::vector<Spot>& spots, double way_m) {
    BeamSweep sweep;
    if (!sweep_of_scan(scan_of(spots), guidance_.config().beams[0], sweep)) return;
    sweep.time_s = way_m;
    guidance_.take(OdometerReading{way_m, std::llround(1000.0 * way_m), std::nan("")});
    guidance_.take(sweep);
  }
  const std::vector<SeenLine>& seen() const { return listener_.lines; }

 private:
  SeenLines listener_;
  Guidance guidance_;
};

double robust_sd(std::vector<double> values) {
  const double middle = upper_median(values);
  for (double& value : values) value = std::abs(value - middle);
  return robust_sigma(values);
}

TEST(RealPaint, TwoTapesAreADoubleLineAndNeverTheOtherWayRound) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("neato-two-tapes");
  auto scans =
      read_spots(testing::real_data("neato-two-tapes") / "neato_0113_0320.csv.gz", kTapeColumns);
  GuidanceConfig config = one_beam(0.13, -0.13, 131);
  config.beams[0].threshold = 1000.0;  // The floor has 300 to 500, a tape 1500 to 2700.
  config.stripe.width_m = 0.012;
  config.stripe.follow = FollowLine::kLeft;
  config.stripe.spacing_m = 0.13;
  config.stripe.lines = {GuidanceLine{LinePattern::kSolid}, GuidanceLine{LinePattern::kSolid}};
  WayAlong way(config);
  for (auto& [key, spots] : scans) {
    // The floor is before it; behind it are walls.
    for (Spot& spot : spots) {
      const double bearing_rad = spot.bearing_deg * M_PI / 180.0;
      spot.x_m = spot.range_m * std::cos(bearing_rad);
      spot.y_m = spot.range_m * std::sin(bearing_rad);
    }
    std::erase_if(spots, [](const Spot& spot) { return spot.x_m < 0.5 * spot.range_m; });
    way.take(spots, 0.02 * key.first);
  }
  std::map<double, std::vector<double>> of_scan;
  for (const SeenLine& line : way.seen()) {
    if (line.kind == SeenKind::kLine) of_scan[line.distance_m].push_back(line.lateral_m);
  }
  std::vector<double> apart_m;
  for (const auto& [distance_m, lateral_m] : of_scan) {
    if (lateral_m.size() != 2) continue;
    // The followed one is said first.
    EXPECT_NEAR(lateral_m[0], 0.067, 0.01) << distance_m;
    EXPECT_NEAR(lateral_m[1], -0.067, 0.01) << distance_m;
    apart_m.push_back(lateral_m[0] - lateral_m[1]);
  }
  std::vector<double> values = apart_m;
  std::printf("both tapes in %zu of %zu scans, %.1f mm apart, robust sd %.2f mm\n", apart_m.size(),
              scans.size(), 1e3 * upper_median(values), 1e3 * robust_sd(apart_m));
  EXPECT_GE(apart_m.size(), 50U);
  EXPECT_LE(robust_sd(apart_m), 1.5e-3);
}

// A place where a ring of the lidar crosses a painted line.
struct Crossing {
  int ring = 0;
  double x_m = 0.0;
  double y_m = 0.0;
};

// The window: from over the left kerb, where the pavement is lighter than the road, to the right
// lane's middle; the line lies about in its middle.
constexpr double kWindowLeft_m = 1.9;
constexpr double kWindowRight_m = -4.3;
constexpr int kWindowSamples = 311;  // 2 cm, about as far as the lidar's points are apart.
constexpr double kMiddle_m = 0.5 * (kWindowLeft_m + kWindowRight_m);

// Where the ring crosses `y_m`.
double place_of(const std::vector<Spot>& ring, double y_m) {
  const auto nearest = std::min_element(
      ring.begin(), ring.end(),
      [&](const Spot& a, const Spot& b) { return std::abs(a.y_m - y_m) < std::abs(b.y_m - y_m); });
  return nearest->x_m;
}

// All lines of a frame, ring by ring: each ring is a sweep with a gain of its own.
std::vector<Crossing> crossings(const std::map<Key, std::vector<Spot>>& rings, int frame) {
  GuidanceBeam beam = one_beam(kWindowLeft_m, kWindowRight_m, kWindowSamples).beams[0];
  PaintFinderOptions options;
  options.samples = static_cast<std::size_t>(beam.samples);
  options.width_samples = 0.1 / beam.sample_m();
  options.width_tolerance = 0.6;
  PaintFinder finder(options);
  std::vector<Crossing> found;
  for (auto at = rings.lower_bound({frame, 0}); at != rings.end() && at->first.first == frame;
       ++at) {
    std::vector<Spot> ahead = at->second;
    // Behind the car is another road; without a reflectance nothing was measured.
    std::erase_if(ahead, [](const Spot& spot) { return spot.x_m < 2.0 || spot.intensity <= 0.0; });
    for (Spot& spot : ahead) spot.intensity *= 100.0;  // In the lidar's own steps.
    BeamSweep sweep;
    if (!sweep_of_scan(scan_of(ahead), beam, sweep)) continue;
    for (const PaintLine& line : finder.find(sweep.samples)) {
      const double y_m = beam.lateral_m(line.centre());
      found.push_back({at->first.second, place_of(ahead, y_m), y_m});
    }
  }
  return found;
}

// The parabola y = c0 + c1 x + c2 x^2 that lies best through some.
Eigen::Vector3d parabola_of(const std::vector<Crossing>& some) {
  Eigen::MatrixX3d powers(some.size(), 3);
  Eigen::VectorXd places(some.size());
  for (Eigen::Index i = 0; i < powers.rows(); ++i) {
    const Crossing& one = some[static_cast<std::size_t>(i)];
    powers.row(i) << 1.0, one.x_m, one.x_m * one.x_m;
    places[i] = one.y_m;
  }
  return powers.colPivHouseholderQr().solve(places);
}

// The most of them that lie along one line, nearly along the car's way.
std::vector<Crossing> on_one_line(const std::vector<Crossing>& all) {
  constexpr double kNear_m = 0.06;
  std::vector<Crossing> best;
  for (const Crossing& a : all) {
    for (const Crossing& b : all) {
      const double slope = (b.y_m - a.y_m) / (b.x_m - a.x_m);
      if (!(b.x_m > a.x_m + 2.0) || std::abs(slope) > 0.15) continue;
      std::vector<Crossing> near;
      for (const Crossing& one : all) {
        if (std::abs(one.y_m - a.y_m - slope * (one.x_m - a.x_m)) < kNear_m) near.push_back(one);
      }
      if (near.size() > best.size()) best = near;
    }
  }
  return best;
}

// How far to the left a kerb lies, by the cubic in the first line of a file of truth: x, to the
// right, of y, forward.
double kerb_left_m(int frame, const char* side, double forward_m) {
  std::ifstream file(testing::real_data("kitti-paint-and-kerb") /
                     ("gt_" + std::to_string(frame) + "_" + side + ".txt"));
  double right_m = 0.0;
  for (double factor = 0.0, i = 0; i < 4 && file >> factor; ++i) {
    right_m = right_m * forward_m + factor;
  }
  return -right_m;
}

constexpr double kFrame_m = 1.15;  // The car's way from frame to frame.

// Where rings saw the road, along the street, and whether the line was there.
using Sightings = std::multimap<double, bool>;

// Where paint begins and ends: the share of rings within 0.4 m that saw it passes a half of the
// largest.
std::vector<double> ends_of_dashes(const Sightings& sightings) {
  constexpr double kStep_m = 0.02;
  constexpr double kAround_m = 0.4;
  std::vector<double> shares;
  const double from_m = sightings.begin()->first + kAround_m;
  const double to_m =
      sightings.rbegin()->first - kAround_m - 3.0 * kFrame_m;  // Three frames see it.
  for (double at_m = from_m; at_m < to_m; at_m += kStep_m) {
    double all = 0.0;
    double seen = 0.0;
    const auto past = sightings.upper_bound(at_m + kAround_m);
    for (auto one = sightings.lower_bound(at_m - kAround_m); one != past; ++one) {
      all += 1.0;
      seen += one->second ? 1.0 : 0.0;
    }
    shares.push_back(all > 0.0 ? seen / all : 0.0);
  }
  const double half = 0.5 * *std::max_element(shares.begin(), shares.end());
  std::vector<double> ends;
  for (std::size_t i = 1; i < shares.size(); ++i) {
    if ((shares[i] > half) != (shares[i - 1] > half)) {
      ends.push_back(from_m + kStep_m * static_cast<double>(i));
    }
  }
  return ends;
}

constexpr double kNearest_m = 4.5;
constexpr double kFarthest_m = 13.0;

TEST(RealPaint, TheBrokenLineOfAStreetIsFoundFromRingToRing) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("kitti-paint-and-kerb");
  const auto rings = read_spots(testing::real_data("kitti-paint-and-kerb") / "frames_30_39.csv.gz",
                                kStreetColumns);
  std::size_t found = 0;
  double squares = 0.0;
  std::size_t crossed = 0;
  Sightings sightings;
  for (int frame = 30; frame < 40; ++frame) {
    const auto line = on_one_line(crossings(rings, frame));
    const Eigen::Vector3d parabola = parabola_of(line);
    std::set<int> seen;
    for (const Crossing& one : line) {
      seen.insert(one.ring);
      const double off_m = one.y_m - parabola.dot(Eigen::Vector3d(1.0, one.x_m, one.x_m * one.x_m));
      squares += off_m * off_m;
      EXPECT_LT(one.y_m, kerb_left_m(frame, "l", one.x_m) - 0.5) << "on the pavement";
      EXPECT_GT(one.y_m, kerb_left_m(frame, "r", one.x_m) + 0.5) << "on the pavement";
    }
    found += seen.size();
    crossed += line.size();
    for (auto at = rings.lower_bound({frame, 0}); at != rings.end() && at->first.first == frame;
         ++at) {
      std::vector<Spot> ahead = at->second;
      std::erase_if(ahead, [](const Spot& spot) { return spot.x_m < 2.0; });
      if (ahead.empty()) continue;
      const double x_m = place_of(ahead, line.front().y_m);
      if (x_m < kNearest_m || x_m > kFarthest_m) continue;
      sightings.emplace(x_m + kFrame_m * (frame - 30), seen.contains(at->first.second));
    }
  }
  const double rms_m = std::sqrt(squares / static_cast<double>(crossed));
  const std::vector<double> ends = ends_of_dashes(sightings);
  std::printf("%.1f rings a frame, %.1f mm rms; ends of dashes:", static_cast<double>(found) / 10.0,
              1e3 * rms_m);
  for (const double end : ends) std::printf(" %.2f", end);
  std::printf("\n");
  EXPECT_GE(found, 120U);
  EXPECT_LE(rms_m, 0.015);
  // It begins on paint: an end first, then two whole dashes.
  ASSERT_EQ(ends.size(), 5U);
  EXPECT_NEAR(0.5 * (ends[2] - ends[1] + ends[4] - ends[3]), 3.0, 0.2);
  EXPECT_NEAR((ends[3] - ends[1] + ends[2] - ends[0] + ends[4] - ends[2]) / 3.0, 6.1, 0.2);
}

}  // namespace
}  // namespace striper
