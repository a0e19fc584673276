// SPDX-License-Identifier: Apache-2.0
// Proves, on exact geometry plus the noise of docs/accuracy.md, that circular pieces are found
// where they are asked for, from outside and from inside, with true error bars, and that straight
// ones stay straight. Surfaces that are nearly circles are not here.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <striper/profile/segments.hpp>
#include <striper/profile/smooth.hpp>

#include "profile/circle_search.hpp"
#include "support/allocation_counter.hpp"
#include "support/profile_scans.hpp"

namespace striper {
namespace {

using testing::ProfileShape;
using testing::ProfileStriper;
using testing::range_of_line;
using testing::Rms;

SegmentOptions with_circles() {
  SegmentOptions options;
  options.find_circles = true;
  return options;
}

// Where a ray meets a circle first, or last; NaN where it does not.
double range_of_circle(double bearing_rad, Eigen::Vector2d centre_m, double radius_m,
                       bool is_hollow = false) {
  const Eigen::Vector2d ray(std::cos(bearing_rad), std::sin(bearing_rad));
  const double along = centre_m.dot(ray);
  const double root = std::sqrt(along * along - centre_m.squaredNorm() + radius_m * radius_m);
  return is_hollow ? along + root : along - root;
}

// What is nearer; NaN is nothing.
double nearer(double a, double b) { return std::fmin(a, b); }

struct CircleScene {
  const char* name;
  ProfileShape shape;
  Eigen::Vector2d centre_m;
  double radius_m;
  bool is_hollow;
  std::size_t pieces;
};

std::vector<CircleScene> circle_scenes() {
  return {{"a pipe before a wall",
           [](double b) {
             return nearer(range_of_circle(b, {1.65, 0.45}, 0.12), range_of_line(b, 0.0, 1.8));
           },
           {1.65, 0.45},
           0.12,
           false,
           3},
          {"a drum",
           [](double b) {
             return nearer(range_of_circle(b, {1.5, 0.0}, 0.5), range_of_line(b, 0.1, 2.8));
           },
           {1.5, 0.0},
           0.5,
           false,
           3},
          {"a pipe from inside",
           [](double b) {
             return range_of_circle(b, {0.3, 0.0}, 1.2, true);
           },
           {0.3, 0.0},
           1.2,
           true,
           1},
          {"a groove",
           [](double b) {
             return std::abs(1.5 * std::tan(b)) < 0.2 ? range_of_circle(b, {1.5, 0.0}, 0.2, true)
                                                      : range_of_line(b, 0.0, 1.5);
           },
           {1.5, 0.0},
           0.2,
           true,
           3},
          {"a slight bow",
           [](double b) {
             return range_of_circle(b, {21.5, 0.0}, 20.0);
           },
           {21.5, 0.0},
           20.0,
           false,
           1}};
}

// The circular piece about there.
const Piece* circular_piece(const Segmentation& found, const CircleScene& scene) {
  for (const Piece& piece : found.pieces)
    if (piece.circle && (piece.circle->centre_m - scene.centre_m).norm() < 0.5 * scene.radius_m)
      return &piece;
  return nullptr;
}

TEST(CircularPieces, AreWhereTheyAreWithTrueBars) {
  const ProfileStriper striper;
  Segmenter segmenter(with_circles());
  Segmentation found;
  PolarScan scan;
  constexpr int kTrials = 400;
  for (const CircleScene& scene : circle_scenes()) {
    const auto ranges = testing::exact_ranges(striper, scene.shape);
    Rms x, y, radius, chi2;
    int right = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      testing::noisy_scan(striper, ranges, scan);
      segmenter.segment(scan, found);
      const Piece* const piece = circular_piece(found, scene);
      ASSERT_NE(piece, nullptr) << scene.name;
      const ScanCircle& circle = *piece->circle;
      for (const Eigen::Vector2d& end : {piece->begin_m, piece->end_m})
        EXPECT_NEAR((end - circle.centre_m).norm() / circle.radius_m, 1.0, 1e-9) << scene.name;
      right += found.pieces.size() == scene.pieces && circle.is_hollow == scene.is_hollow ? 1 : 0;
      x.add((circle.centre_m.x() - scene.centre_m.x()) / std::sqrt(circle.covariance(0, 0)));
      y.add((circle.centre_m.y() - scene.centre_m.y()) / std::sqrt(circle.covariance(1, 1)));
      radius.add((circle.radius_m - scene.radius_m) / std::sqrt(circle.covariance(2, 2)));
      chi2.add(std::sqrt(piece->chi2 / piece->dof));
    }
    EXPECT_GE(right, kTrials * 95 / 100) << scene.name;  // Limbs are sometimes short pieces.
    EXPECT_NEAR(x.value(), 1.0, 0.1) << scene.name;
    EXPECT_NEAR(y.value(), 1.0, 0.1) << scene.name;
    EXPECT_NEAR(radius.value(), 1.0, 0.1) << scene.name;
    EXPECT_NEAR(chi2.value(), 1.0, 0.02) << scene.name;
  }
}

// A kerb's nose: where a surface bends into the arc the cut is uncertain by as much as it does not
// matter, and the bars do not have that.
TEST(CircularPieces, RoundedEdgesAreFoundAndNearlyTrue) {
  const ProfileStriper striper;
  const auto ranges = testing::exact_ranges(striper, [](double b) {
    const double on_face = range_of_line(b, 0.0, 1.5);
    if (on_face * std::sin(b) < 0.0) return on_face;
    return nearer(range_of_circle(b, {1.6, 0.0}, 0.1), range_of_line(b, 0.0, 2.6));
  });
  Segmenter segmenter(with_circles());
  Segmentation found;
  PolarScan scan;
  Rms radius;
  for (int trial = 0; trial < 400; ++trial) {
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    for (const Piece& piece : found.pieces) {
      if (!piece.circle) continue;
      radius.add((piece.circle->radius_m - 0.1) / std::sqrt(piece.circle->covariance(2, 2)));
    }
  }
  EXPECT_GE(radius.count(), 396);
  EXPECT_LE(radius.count(), 404);
  EXPECT_LT(radius.value(), 1.3);
}

TEST(CircularPieces, StraightOnesAreBentAsSeldomAsStated) {
  const ProfileStriper striper;
  SegmentOptions options = with_circles();
  options.false_split_rate = 1e-2;
  Segmenter segmenter(options);
  Segmentation found;
  PolarScan scan;
  int bent = 0;
  constexpr int kScans = 4000;
  const auto ranges =
      testing::exact_ranges(striper, [](double b) { return range_of_line(b, 0.2, 1.5); });
  for (int k = 0; k < kScans; ++k) {
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    for (const Piece& piece : found.pieces) bent += piece.circle ? 1 : 0;
  }
  EXPECT_NEAR(bent, 1e-2 * kScans, 20.0);  // Three sigmas.
}

TEST(CircularPieces, CornersAndStepsAreNone) {
  const ProfileStriper striper;
  std::vector<double> ranges;
  for (std::size_t i = 0; i < 640; ++i) {
    const std::size_t board = i / 40;
    const auto kind = static_cast<double>(board % 4);
    ranges.push_back(range_of_line(striper.bearing_rad(i), 0.2 * kind - 0.3, 1.0 + 0.1 * kind));
  }
  Segmenter segmenter(with_circles());
  Segmentation found;
  PolarScan scan;
  int circular = 0;
  for (int k = 0; k < 200; ++k) {
    testing::noisy_scan(striper, ranges, scan);
    segmenter.segment(scan, found);
    for (const Piece& piece : found.pieces) circular += piece.circle ? 1 : 0;
  }
  EXPECT_LE(circular, 8);  // Of 3200, at 1e-3: three, and five of chance.
}

TEST(CircularPieces, AreOnlyWhereTheyAreAskedFor) {
  const ProfileStriper striper;
  const CircleScene scene = circle_scenes()[0];
  PolarScan scan;
  testing::noisy_scan(striper, testing::exact_ranges(striper, scene.shape), scan);
  Segmentation found;
  Segmenter().segment(scan, found);
  EXPECT_EQ(circular_piece(found, scene), nullptr);
  EXPECT_GT(found.pieces.size(), 3U);
}

TEST(CircularPieces, AreSmoothedOnTheirCircles) {
  const ProfileStriper striper;
  const auto ranges = testing::exact_ranges(striper, circle_scenes()[2].shape);
  Smoother smoother(with_circles());
  PolarScan scan;
  Rms gain, pull;
  for (int k = 0; k < 300; ++k) {
    testing::noisy_scan(striper, ranges, scan);
    smoother.smooth(scan);
    for (std::size_t i = 0; i < ranges.size(); i += 10) {
      const double e = scan.returns[i].range_m - ranges[i];
      gain.add(e / striper.sigma_m(i, ranges[i]));
      pull.add(e / scan.returns[i].sigma_m);
    }
  }
  EXPECT_LT(gain.value(), 0.08);  // The bound: sqrt(3 / 640) = .068.
  EXPECT_NEAR(pull.value(), 1.0, 0.06);
}

TEST(CircularPieces, NothingIsAllocatedInAStream) {
  const ProfileStriper striper;
  const auto ranges = testing::exact_ranges(striper, circle_scenes()[1].shape);
  std::array<PolarScan, 4> scans;
  for (PolarScan& scan : scans) testing::noisy_scan(striper, ranges, scan);
  Segmenter segmenter(with_circles());
  Segmentation found;
  for (const PolarScan& scan : scans) segmenter.segment(scan, found);
  const testing::AllocationCounter counter;
  for (const PolarScan& scan : scans) segmenter.segment(scan, found);
  EXPECT_EQ(counter.count(), 0U);
}

TEST(BendPenalty, IsTheTailOfChi2) {
  for (const double rate : {0.1, 1e-2, 1e-3, 1e-6}) {
    const double tail = std::erfc(std::sqrt(0.5 * detail::bend_penalty(rate)));
    EXPECT_NEAR(tail / rate, 1.0, 0.1) << rate;
  }
}

// Where a ball or a pipe turns away no return is on a straight line with its neighbours.
TEST(OutlierGate, KeepsTheLimbOfAPipeAndDropsWhatIsNotOnIt) {
  const ProfileStriper striper;
  constexpr int kScans = 40;
  const auto pipe = testing::exact_ranges(striper, [](double b) {
    return range_of_circle(b, {1.4, 0.0}, 0.25);
  });
  const auto first = std::find_if(pipe.begin(), pipe.end(), [](double r) { return r > 0.0; });
  const auto off = static_cast<std::size_t>(first - pipe.begin()) + 40;
  int returns = 0;
  int lost = 0;
  int dropped = 0;
  for (int k = 0; k < kScans; ++k) {
    PolarScan scan;
    testing::noisy_scan(striper, pipe, scan);
    scan.returns[off] =
        testing::return_at(striper, off, pipe[off] + 30.0 * scan.returns[off].sigma_m);
    Segmentation found;
    Segmenter(SegmentOptions{}).segment(scan, found);
    for (const Return& r : scan.returns) returns += r.status == ReturnStatus::kOk ? 1 : 0;
    const bool is_dropped = std::binary_search(found.outliers.begin(), found.outliers.end(), off);
    dropped += is_dropped ? 1 : 0;
    lost += static_cast<int>(found.outliers.size()) - (is_dropped ? 1 : 0);
  }
  EXPECT_GT(returns, 100 * kScans);
  EXPECT_EQ(dropped, kScans);
  EXPECT_LT(lost, 4 * kScans) << "a few at each end, where the profile is steepest";
}

}  // namespace
}  // namespace striper
