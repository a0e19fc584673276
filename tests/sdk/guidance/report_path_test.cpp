// SPDX-License-Identifier: Apache-2.0
// Proves that the baseline is the report's: exact on parabolas with three beams, on straight lines
// with two, smoothed by its equation (12), keeping its answer where nothing is seen; and that its
// noise at the gun is what the weights make of the beams'. Does not prove that it is good.
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/guidance/report_path.hpp>

namespace striper {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kFoot = 0.3048;
constexpr std::array<double, 3> kBeams_m = {8 * kFoot, 5 * kFoot, -8 * kFoot};

ReportPath path(double alpha) {
  ReportPathOptions options;
  options.beam_x_m.assign(kBeams_m.begin(), kBeams_m.end());
  options.alpha = alpha;
  return ReportPath(options);
}

std::array<double, 3> parabola(double a, double b, double c) {
  std::array<double, 3> y_m;
  for (std::size_t i = 0; i < y_m.size(); ++i) {
    y_m[i] = a * kBeams_m[i] * kBeams_m[i] + b * kBeams_m[i] + c;
  }
  return y_m;
}

TEST(ReportPath, IsExactOnAParabola) {
  const ReportPathPoint point = path(0.0).update(parabola(0.03, -0.2, 0.11));
  EXPECT_NEAR(point.lateral_m, 0.11, 1e-12);
  EXPECT_EQ(point.beams, 3);
}

TEST(ReportPath, FallsBackToTheStraightLineThroughAnyTwoBeams) {
  for (std::size_t missing = 0; missing < 3; ++missing) {
    std::array<double, 3> y_m = parabola(0.0, -0.2, 0.11);
    y_m[missing] = kNone;
    const ReportPathPoint point = path(0.0).update(y_m);
    EXPECT_NEAR(point.lateral_m, 0.11, 1e-12) << missing;
    EXPECT_EQ(point.beams, 2);
  }
}

TEST(ReportPath, OfOneBeamIsAParallel) {
  const ReportPathPoint point = path(0.0).update(std::array{kNone, 0.25, kNone});
  EXPECT_EQ(point.lateral_m, 0.25);
  EXPECT_EQ(point.beams, 1);
}

TEST(ReportPath, TakesTheLastPositionOfABeamThatSeesNothing) {
  ReportPath stripe = path(0.0);
  std::array<double, 3> y_m = parabola(0.03, -0.2, 0.11);
  stripe.update(y_m);
  y_m[0] = kNone;
  const ReportPathPoint point = stripe.update(y_m);
  EXPECT_NEAR(point.lateral_m, 0.11, 1e-12);
  EXPECT_EQ(point.beams, 2);
}

TEST(ReportPath, KeepsItsAnswerWhereNothingIsSeen) {
  ReportPath stripe = path(0.5);
  EXPECT_TRUE(std::isnan(stripe.update(std::array{kNone, kNone, kNone}).lateral_m));
  stripe.update(std::array{0.3, 0.3, 0.3});
  for (int i = 0; i < 10; ++i) {
    const ReportPathPoint point = stripe.update({});
    EXPECT_NEAR(point.lateral_m, 0.3, 1e-12);
    EXPECT_EQ(point.beams, 0);
  }
}

TEST(ReportPath, SmoothsByTheReportsSum) {
  // Equation (12), with the first answer in place of the sum over what was before.
  for (const double alpha : {0.5, 0.9}) {
    ReportPath stripe = path(alpha);
    const std::vector<double> readings = {0.1, 0.4, -0.2, 0.3, 0.0, 0.7};
    for (std::size_t n = 0; n < readings.size(); ++n) {
      const double reading = readings[n];
      double sum = std::pow(alpha, n) * readings[0];
      for (std::size_t i = 0; i < n; ++i) sum += (1 - alpha) * std::pow(alpha, i) * readings[n - i];
      EXPECT_NEAR(stripe.update(std::array{reading, reading, reading}).lateral_m, sum, 1e-12) << n;
    }
  }
}

TEST(ReportPath, AmplifiesNoiseByItsWeightsAndSmoothing) {
  // 1.85 at the gun; smoothing independent noise leaves sqrt((1 - alpha) / (1 + alpha)) of it.
  constexpr int kScans = 40000;
  for (const double alpha : {0.0, 0.5, 0.9}) {
    std::mt19937 random(1991);
    std::normal_distribution<double> noise(0.0, 0.01);
    ReportPath stripe = path(alpha);
    double squares = 0.0;
    for (int i = 0; i < kScans; ++i) {
      const std::array<double, 3> y_m = {noise(random), noise(random), noise(random)};
      const double error_m = stripe.update(y_m).lateral_m;
      squares += error_m * error_m;
    }
    const double expected_m = 0.01 * 1.850 * std::sqrt((1 - alpha) / (1 + alpha));
    EXPECT_NEAR(std::sqrt(squares / kScans) / expected_m, 1.0, 0.05) << alpha;
  }
}

TEST(ReportPath, IntegerSmoothingSettlesUpToACountLow) {
  int last = 0;
  for (int i = 0; i < 20; ++i) last = report_integer_smoothing(1000, last);
  EXPECT_EQ(last, 999);
  for (int i = 0; i < 20; ++i) last = report_integer_smoothing(-1000, last);
  EXPECT_EQ(last, -1000);
}

TEST(ReportPath, RefusesWhatDeterminesNothing) {
  EXPECT_THROW(ReportPath{ReportPathOptions{}}, Error);
  EXPECT_THROW(path(1.0), Error);
  EXPECT_THROW(path(kNone), Error);
  EXPECT_THROW((ReportPath{{.beam_x_m = {2.4, 2.4}, .alpha = 0.5}}), Error);
  EXPECT_THROW((ReportPath{{.beam_x_m = std::vector<double>(9, 1.0), .alpha = 0.5}}), Error);
}

}  // namespace
}  // namespace striper
