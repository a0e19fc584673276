// SPDX-License-Identifier: Apache-2.0
// Proves, on recordings of turning lidars in real streets, that curbs are found where people saw
// them, that nothing else is called one, and that the same curb, scanned again and again from one
// place, is at the same place and as high. Not a striper's scans: coarser (.1 to .25 degrees) and
// noisier (5 to 20 mm); the truth of the first is by hand, to a decimetre.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <striper/core/csv_table.hpp>
#include <striper/core/robust.hpp>
#include <striper/detect/curb_finder.hpp>

#include "support/shared_data.hpp"

namespace striper {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Across the way: to the left and up. What a ray's noise does to a point is along the ray here,
/// too, by as much less as the point is nearer.
/// @param p_m from the sensor: ahead, left, up.
Return return_across(const Vector3d& p_m, double sigma_range_m) {
  const Vector2d at = p_m.tail<2>();
  Return r;
  r.x_m = at.x();
  r.y_m = at.y();
  r.range_m = at.norm();
  r.bearing_rad = std::atan2(at.y(), at.x());
  r.sigma_m = sigma_range_m * r.range_m / p_m.norm();
  r.confidence = 1.0F;
  r.status = ReturnStatus::kOk;
  return r;
}

CurbOptions upright() {
  CurbOptions options;
  options.up_rad = std::numbers::pi / 2.0;
  return options;
}

PolarScan empty_scan() {
  PolarScan scan;
  scan.axis = StripeAxis::kRows;
  return scan;
}

// --- Rings of a moving vehicle's lidar, each seen from behind: to the left and up.

struct RingPoint {
  int frame = 0, ring = 0;
  double x_m = 0.0, y_m = 0.0, z_m = 0.0;
};

constexpr std::array kRingColumns{
    csv_column<RingPoint>(
        "frame", [](auto& r) -> auto& { return r.frame; }, CsvNeed::kRequired),
    csv_column<RingPoint>(
        "ring", [](auto& r) -> auto& { return r.ring; }, CsvNeed::kRequired),
    csv_column<RingPoint>(
        "x_m", [](auto& r) -> auto& { return r.x_m; }, CsvNeed::kRequired),
    csv_column<RingPoint>(
        "y_m", [](auto& r) -> auto& { return r.y_m; }, CsvNeed::kRequired),
    csv_column<RingPoint>(
        "z_m", [](auto& r) -> auto& { return r.z_m; }, CsvNeed::kRequired),
};

using Ring = std::vector<RingPoint>;
using RingName = std::pair<int, int>;  // Frame, ring.

constexpr const char* kRings = "kitti-paint-and-kerb";
constexpr double kRingSigma_m = 0.02;  // Its maker's figure.

std::map<RingName, Ring> load_rings() {
  CsvReader<RingPoint> reader(
      CsvInput::of_text("rings",
                        testing::unpacked(testing::real_data(kRings) / "frames_30_39.csv.gz")),
      kRingColumns, "a table of rings");
  std::map<RingName, Ring> rings;
  RingPoint point;
  while (reader.next(point)) rings[{point.frame, point.ring}].push_back(point);
  for (auto& [name, ring] : rings) {
    std::sort(ring.begin(), ring.end(), [](const RingPoint& a, const RingPoint& b) {
      return a.y_m * b.x_m < b.y_m * a.x_m;  // By azimuth.
    });
  }
  return rings;
}

/// A curb by hand: a cubic of how far ahead, good as far as somebody picked points.
class DrawnCurb {
 public:
  DrawnCurb(int frame, char side) {
    std::ifstream file(testing::real_data(kRings) / fmt::format("gt_{}_{}.txt", frame, side));
    file >> cubic_[0] >> cubic_[1] >> cubic_[2] >> cubic_[3];
    Vector3d point;
    while (file >> point.x() >> point.y() >> point.z()) {
      from_m_ = std::min(from_m_, point.y());
      to_m_ = std::max(to_m_, point.y());
    }
  }

  /// To the left, NaN where nobody looked.
  double left_m(double ahead_m) const {
    if (ahead_m < from_m_ || ahead_m > to_m_) return std::nan("");
    return -(((cubic_[0] * ahead_m + cubic_[1]) * ahead_m + cubic_[2]) * ahead_m + cubic_[3]);
  }

  /// Where a ring crosses it, if it has points on both sides there.
  std::optional<double> crossing_m(const Ring& ring) const {
    constexpr double kBeside_m = 0.5;
    for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
      const double here = ring[i].y_m - left_m(ring[i].x_m);
      const double next = ring[i + 1].y_m - left_m(ring[i + 1].x_m);
      if (!(here <= 0.0 && next > 0.0)) continue;
      const double at = ring[i].y_m;
      const auto has = [&](double from, double to) {
        return std::count_if(ring.begin(), ring.end(), [&](const RingPoint& p) {
                 return p.y_m > at + from && p.y_m < at + to;
               }) >= 5;
      };
      if (has(-kBeside_m, 0.0) && has(0.0, kBeside_m)) return at;
    }
    return std::nullopt;
  }

 private:
  std::array<double, 4> cubic_{};
  double from_m_ = 1e9;
  double to_m_ = -1e9;
};

std::optional<double> ahead_of(const Ring& ring) {
  double sum = 0.0;
  int count = 0;
  for (const RingPoint& p : ring) {
    if (std::abs(p.y_m) > 1.0) continue;
    sum += p.x_m;
    ++count;
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

/// How far to the left the foot of the curb on a side is, where one was found.
std::optional<double> found_m(const CurbView& view, char side) {
  std::optional<double> foot;
  for (const CurbFinding& f : view.findings) {
    const bool is_here = (f.lateral_m > 0.0) == (side == 'l');
    if (is_here && f.probability() > 0.5) foot = f.foot_m.x();
  }
  return foot;
}

TEST(CurbReal, RingsOfALidarCrossCurbsWherePeopleSawThem) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("kitti-paint-and-kerb");
  CurbFinder finder(upright());
  PolarScan scan = empty_scan();
  int in_view = 0;
  int near = 0;
  int wrong = 0;
  for (const auto& [name, ring] : load_rings()) {
    const auto ahead = ahead_of(ring);
    if (!ahead || *ahead < 4.5 || *ahead > 12.0) continue;
    scan.returns.clear();
    for (const RingPoint& p : ring)
      scan.returns.push_back(return_across({p.x_m, p.y_m, p.z_m}, kRingSigma_m));
    const CurbView& view = finder.find(scan);
    for (const char side : {'l', 'r'}) {
      const auto truth = DrawnCurb(name.first, side).crossing_m(ring);
      if (!truth) continue;
      ++in_view;
      const auto found = found_m(view, side);
      if (!found) continue;
      near += std::abs(*found - *truth) <= 0.2 ? 1 : 0;
      wrong += std::abs(*found - *truth) > 0.5 ? 1 : 0;
    }
  }
  std::cout << fmt::format("{} crossings in view: {} within .2 m, {} beyond .5 m\n", in_view, near,
                           wrong);
  EXPECT_GE(in_view, 250);
  EXPECT_GE(near, in_view * 90 / 100);
  EXPECT_LE(wrong, in_view * 2 / 100);
}

// --- A lidar that nods: the same street again and again from one place on the pavement.

constexpr const char* kNods = "jmaye-curb-lidar";
constexpr double kNodSigma_m = 0.01;  // Its maker's figure for repeated ranges.
// Where the sweeps' planes meet, to a centimetre, in the frame of the points.
const Vector3d kNodOrigin_m(-0.02, 0.0, 0.26);
// By which the pavement falls ahead in that frame: from .92 m below at 1.5 m to 1.25 m at 6.2 m.
constexpr double kNodSlope = 0.0708;
// Where the main curb is: a line.
constexpr double kNodLeft_m = 0.967;
constexpr double kNodTurn = 0.0773;

using Sweep = std::vector<Vector3d>;  // From the sensor.

std::vector<Sweep> load_sweeps(const std::string& name) {
  constexpr double kJump_rad = 1.0;
  const std::string text = testing::unpacked(testing::real_data(kNods) / (name + ".log.gz"));
  std::vector<Sweep> sweeps(1);
  double before = 0.0;
  const char* at = text.c_str();
  char* end = nullptr;
  for (;; at = end) {
    Vector3d p;
    for (int k = 0; k < 3; ++k) p[k] = std::strtod(k == 0 ? at : end, &end);
    if (end == at) break;
    const double azimuth = std::atan2(p.y(), p.x());
    if (std::abs(azimuth - before) > kJump_rad && !sweeps.back().empty()) sweeps.emplace_back();
    before = azimuth;
    // Level as the pavement is.
    sweeps.back().push_back(Eigen::AngleAxisd(-std::atan(kNodSlope), Vector3d::UnitY()) *
                            (p - kNodOrigin_m));
  }
  return sweeps;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

struct Stretch {
  std::vector<double> left_m, height_m;
};

/// The main curb of a scan, a stretch for each metre ahead.
std::map<int, Stretch> stretches_of(const std::string& name) {
  CurbFinder finder(upright());
  PolarScan scan = empty_scan();
  std::map<int, Stretch> stretches;
  for (const Sweep& sweep : load_sweeps(name)) {
    scan.returns.clear();
    for (const Vector3d& p : sweep) {
      const bool is_before = p.x() > 0.5 && p.z() < -1.0;
      if (is_before) scan.returns.push_back(return_across(p, kNodSigma_m));
    }
    for (const CurbFinding& f : finder.find(scan).findings) {
      if (f.probability() < 0.5) continue;
      const auto nearest =
          std::min_element(sweep.begin(), sweep.end(), [&](const Vector3d& a, const Vector3d& b) {
            return (a.tail<2>() - f.foot_m).norm() < (b.tail<2>() - f.foot_m).norm();
          });
      const double ahead = nearest->x();
      // The main curb, and by how much it is from parallel to the way.
      const double left = f.foot_m.x() - kNodTurn * ahead;
      if (std::abs(left - kNodLeft_m) > 0.15) continue;
      Stretch& stretch = stretches[static_cast<int>(ahead)];
      stretch.left_m.push_back(left);
      stretch.height_m.push_back(f.kind == CurbKind::kDown ? -f.height_m : f.height_m);
    }
  }
  return stretches;
}

double deviation_of(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double v : values) squares += (v - mean_of(values)) * (v - mean_of(values));
  return std::sqrt(squares / (static_cast<double>(values.size()) - 1.0));
}

// `scan-00` stands two degrees and 6 cm beside the others, to which the truth of the height applies
// as well.
TEST(CurbReal, TheSameCurbIsAtTheSamePlace) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("jmaye-curb-lidar");
  std::map<int, Stretch> pooled;  // Of each scan its mean.
  for (const char* name : {"scan-02", "scan-03", "scan-04", "scan-05", "scan-06", "scan-07"}) {
    for (const auto& [metre, stretch] : stretches_of(name)) {
      pooled[metre].left_m.push_back(mean_of(stretch.left_m));
      pooled[metre].height_m.push_back(mean_of(stretch.height_m));
    }
  }
  std::vector<double> heights;
  for (int metre = 1; metre <= 6; ++metre) {
    const Stretch& stretch = pooled[metre];
    ASSERT_EQ(stretch.left_m.size(), 6U) << metre;
    const std::string what =
        fmt::format("{} m ahead: place {:.1f} mm, height {:.1f} mm (mean {:.1f})", metre,
                    1e3 * deviation_of(stretch.left_m), 1e3 * deviation_of(stretch.height_m),
                    1e3 * mean_of(stretch.height_m));
    std::cout << what << "\n";
    EXPECT_LE(deviation_of(stretch.left_m), metre == 1 ? 0.008 : 0.020) << what;
    EXPECT_LE(deviation_of(stretch.height_m), 0.005) << what;
    heights.push_back(mean_of(stretch.height_m));
  }
  EXPECT_NEAR(mean_of(heights), -0.079, 0.005);
}

}  // namespace
}  // namespace striper
