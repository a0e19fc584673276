// SPDX-License-Identifier: Apache-2.0
// Proves, on exact geometry plus the noise of docs/accuracy.md: foot and height of a curb in one
// scan are as exact as its returns allow (the Cramer-Rao bound of the four-vertex line), from .05
// to .5 px, 1 to 3 m, 5 to 25 cm, tilted by up to 5 degrees, with 30 % of the returns missing and
// 2 % gross outliers, and their error bars are true; with the calibration's too, by stripers drawn
// from its covariance. What one scan cannot tell from nothing is not asked for.
#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <numbers>
#include <vector>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <striper/detect/curb_finder.hpp>

#include "support/drawn_striper.hpp"
#include "support/models.hpp"
#include "support/road_scans.hpp"

namespace striper {
namespace {

using testing::curb_profile;
using testing::Rms;
using testing::RoadProfile;
using testing::RoadStriper;

constexpr double kDegree = std::numbers::pi / 180.0;

#ifdef STRIPER_FULL_TRIALS
constexpr int kTrials = 1000;
constexpr double kPullBand = 0.1;
#else
constexpr int kTrials = 100;
constexpr double kPullBand = 0.2;
#endif

// How far returns that count are from what they say.
struct Noise {
  double row_sigma_px = 0.1;
  double missing = 0.0;
  double outliers = 0.0;
};

struct Shape {
  double lateral_m, height_m;
  double batter_rad = 0.0;
};

// Where road, face and top are: road height and slope, foot, face angle, height, slope of the top.
using Parameters = Eigen::Matrix<double, 6, 1>;

RoadProfile profile_of(const Parameters& p) {
  const auto road = [&](double x) { return p[0] + p[1] * x; };
  const Eigen::Vector2d foot(p[2], road(p[2]));
  const Eigen::Vector2d normal = Eigen::Vector2d(-p[1], 1.0).normalized();
  const Eigen::Vector2d along(normal.y(), -normal.x());
  const Eigen::Vector2d edge = foot + p[4] * (normal + std::tan(p[3]) * along);
  return {{-1.0, road(-1.0)}, foot, edge, edge + Eigen::Vector2d(6.0, 6.0 * p[5])};
}

// Fewer returns make no piece of the top: it is as good as out of view.
constexpr int kFewestOfTop = 5;
constexpr int kFewestOfFace = 2;

// The bound of foot and height, one sigma each, of the returns that say where the curb is: those
// that neither are missing nor were put somewhere else. NaN where they do not say.
std::array<double, 2> bound_of(const RoadStriper& road, const Shape& shape,
                               const std::vector<bool>& counts) {
  Parameters p;
  p << 0.0, 0.0, shape.lateral_m, shape.batter_rad, shape.height_m, 0.0;
  constexpr double kStep = 1e-6;
  std::array<std::vector<double>, 6> more, less;
  for (int k = 0; k < 6; ++k) {
    Parameters by = Parameters::Zero();
    by[k] = kStep;
    more[static_cast<std::size_t>(k)] = ranges_of_profile(road, profile_of(p + by));
    less[static_cast<std::size_t>(k)] = ranges_of_profile(road, profile_of(p - by));
  }
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  constexpr double kMoves = 1e-6;
  int on_face = 0;
  int on_top = 0;
  for (std::size_t i = 0; i < more[0].size(); ++i) {
    Parameters d;
    for (int k = 0; k < 6; ++k) {
      const auto row = static_cast<std::size_t>(k);
      d[k] = (1.0 / more[row][i] - 1.0 / less[row][i]) / (2.0 * kStep);
    }
    if (!counts[i] || !d.allFinite()) continue;
    information += d * d.transpose() / std::pow(road.striper.sigma_q(i), 2);
    on_face += std::abs(d[2]) > kMoves ? 1 : 0;  // The foot's place moves the face alone,
    on_top += std::abs(d[5]) > kMoves ? 1 : 0;   // the top's slope the top alone.
  }
  const Eigen::Matrix<double, 6, 6> covariance = information.inverse();
  const bool is_known = on_top >= kFewestOfTop && on_face >= kFewestOfFace;
  if (!is_known) return {std::nan(""), std::nan("")};
  return {std::sqrt(covariance(2, 2)), std::sqrt(covariance(4, 4))};
}

// Which returns still say where the curb is.
std::vector<bool> spoil(const RoadStriper& road, const Noise& noise, PolarScan& scan) {
  const std::vector<Return> exact = scan.returns;
  testing::add_gross_outliers(road.striper, noise.outliers, scan);
  std::vector<bool> counts;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    Return& r = scan.returns[i];
    const bool is_missing = testing::uniform(0.0, 1.0) < noise.missing;
    if (is_missing) r.status = ReturnStatus::kNoStripe;
    counts.push_back(!is_missing && r.range_m == exact[i].range_m);
  }
  return counts;
}

struct Errors {
  Rms foot, height, foot_pull, height_pull;
  double foot_bound = 0.0, height_bound = 0.0;  // Root mean squares.
  int in_view = 0;
  int found = 0;
};

Errors errors_of(const Shape& shape, const Noise& noise) {
  RoadStriper road;
  road.striper.row_sigma_px = noise.row_sigma_px;
  CurbFinder finder;
  PolarScan scan;
  Errors errors;
  Rms foot_bound, height_bound;
  for (int trial = 0; trial < kTrials; ++trial) {
    road.roll_rad = testing::uniform(-5.0, 5.0) * kDegree;
    Shape here = shape;
    here.lateral_m += testing::uniform(-0.01, 0.01);  // Anywhere between two returns.
    road_scan(road,
              ranges_of_profile(road, curb_profile(here.lateral_m, here.height_m, here.batter_rad)),
              scan);
    const auto bound = bound_of(road, here, spoil(road, noise, scan));
    if (!std::isfinite(bound[0]) || !std::isfinite(bound[1]))
      continue;  // The edge is out of view, or no return is on the face.
    ++errors.in_view;
    const CurbView& view = finder.find(scan);
    if (view.findings.empty() || view.findings.back().kind != CurbKind::kUp) continue;
    const CurbFinding& f = view.findings.back();
    ++errors.found;
    foot_bound.add(bound[0]);
    height_bound.add(bound[1]);
    errors.foot.add(f.lateral_m - here.lateral_m);
    errors.height.add(f.height_m - here.height_m);
    errors.foot_pull.add((f.lateral_m - here.lateral_m) / f.sigma_lateral_m);
    errors.height_pull.add((f.height_m - here.height_m) / f.sigma_height_m);
  }
  errors.foot_bound = foot_bound.value();
  errors.height_bound = height_bound.value();
  return errors;
}

void expect_at_the_bound(const Shape& shape, const Noise& noise) {
  Errors e = errors_of(shape, noise);
  const std::string what = fmt::format(
      "{} px, {} m, {} cm, missing {}: found {} of {}; foot {:.2f} mm, {:.2f} of the bound, pull "
      "{:.2f}; height {:.2f} mm, {:.2f}, pull {:.2f}",
      noise.row_sigma_px, shape.lateral_m, 100.0 * shape.height_m, noise.missing, e.found,
      e.in_view, 1e3 * e.foot.value(), e.foot.value() / e.foot_bound, e.foot_pull.value(),
      1e3 * e.height.value(), e.height.value() / e.height_bound, e.height_pull.value());
  std::cout << what << "\n";
  EXPECT_GE(e.found, e.in_view * 95 / 100) << what;
  const bool is_whole = noise.missing == 0.0;
  EXPECT_LE(e.foot.value(), 1.25 * e.foot_bound) << what;
  EXPECT_LE(e.height.value(), 1.25 * e.height_bound) << what;
  const double band = is_whole ? kPullBand : 1.2 * kPullBand;
  EXPECT_NEAR(e.foot_pull.value(), 1.0, band) << what;
  EXPECT_NEAR(e.height_pull.value(), 1.0, band) << what;
}

#ifdef STRIPER_FULL_TRIALS
TEST(CurbBound, FootAndHeightReachItOverTheWholeGrid) {
  for (const double missing : {0.0, 0.3}) {
    for (const double row_sigma_px : {0.05, 0.1, 0.27, 0.5}) {
      for (const double lateral : {1.0, 2.0, 3.0}) {
        for (const double height : {0.05, 0.10, 0.15, 0.25})
          expect_at_the_bound({lateral, height},
                              {row_sigma_px, missing, missing > 0.0 ? 0.02 : 0.0});
      }
    }
  }
}
#else
TEST(CurbBound, FootAndHeightReachIt) {
  expect_at_the_bound({1.0, 0.10}, {0.1, 0.0, 0.0});
  expect_at_the_bound({2.0, 0.15}, {0.27, 0.0, 0.0});
  expect_at_the_bound({2.0, 0.10}, {0.27, 0.3, 0.02});
}
#endif

// The striper is not quite what its model says; sigma_cal says by how much.
TEST(CurbCalibration, ErrorBarsWithTheCalibrationsAreTrue) {
  auto model = std::make_shared<StriperModel>(testing::typical_model());
  model->covariance = testing::plausible_covariance(*model);
  CurbFinder finder({}, model);
  const RoadStriper road;
  PolarScan scan;
  Rms foot, height;
  for (int trial = 0; trial < 5 * kTrials; ++trial) {
    const double at = 1.5 + testing::uniform(-0.3, 0.3);
    const double high = testing::uniform(0.08, 0.2);
    const RoadProfile profile = testing::curb_profile(at, high, testing::uniform(0.0, 0.3));
    const testing::DrawnStriper striper(*model, testing::drawn_model(*model), 0.05);
    striper.scan([&](double b) { return range_of_profile(road, profile, b); }, scan);
    const CurbView& view = finder.find(scan);
    ASSERT_FALSE(view.findings.empty());
    const CurbFinding& f = view.findings.back();
    ASSERT_EQ(f.kind, CurbKind::kUp);
    // Most of the error is the calibration's.
    EXPECT_GT(f.sigma_cal_lateral_m, f.sigma_lateral_m);
    foot.add((f.lateral_m - at) / std::hypot(f.sigma_lateral_m, f.sigma_cal_lateral_m));
    height.add((f.height_m - high) / std::hypot(f.sigma_height_m, f.sigma_cal_height_m));
  }
  EXPECT_NEAR(foot.value(), 1.0, 0.1);
  EXPECT_NEAR(height.value(), 1.0, 0.1);
}

TEST(CurbCalibration, IsUnknownWithoutACovariance) {
  auto model = std::make_shared<StriperModel>(testing::typical_model());
  PolarScan scan;
  const RoadStriper road;
  const testing::DrawnStriper striper(*model, *model, 0.05);
  const RoadProfile profile = testing::curb_profile(1.5, 0.12);
  striper.scan([&](double b) { return range_of_profile(road, profile, b); }, scan);
  CurbFinder finder({}, model);
  const CurbView& view = finder.find(scan);
  ASSERT_FALSE(view.findings.empty());
  EXPECT_TRUE(std::isnan(view.findings.back().sigma_cal_lateral_m));
  EXPECT_TRUE(std::isnan(view.findings.back().sigma_cal_height_m));
  EXPECT_NEAR(view.findings.back().lateral_m, 1.5, 0.005);
}

}  // namespace
}  // namespace striper
