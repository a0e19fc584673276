// SPDX-License-Identifier: Apache-2.0
// Proves on sweeps made of boxes seen through a Gaussian spot that lines are found where they are,
// with the error that they claim, whatever the threshold, and that road, cut lines and lines of
// another width are none. Does not prove what worn edges do.
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/guidance/paint_finder.hpp>

namespace striper {
namespace {

constexpr double kRoad = 100.0;
constexpr double kHeight = 800.0;
constexpr double kWidth = 16.0;

class Sweeps {
 public:
  explicit Sweeps(double noise, double spot = 0.6) : noise_(0.0, noise), spot_(spot) {}

  std::vector<double> make(const std::vector<double>& centres, double width = kWidth) {
    std::vector<double> sweep(142);
    for (std::size_t i = 0; i < sweep.size(); ++i) {
      sweep[i] = kRoad + noise_(random_);
      for (const double centre : centres) {
        const double offset = static_cast<double>(i) - centre;
        sweep[i] += kHeight * (cdf(offset + width / 2) - cdf(offset - width / 2));
      }
    }
    return sweep;
  }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

 private:
  double cdf(double x) const { return 0.5 * std::erfc(-x / (spot_ * std::sqrt(2.0))); }

  std::mt19937 random_{1991};
  std::normal_distribution<double> noise_;
  double spot_;
};

PaintFinder finder(double threshold = std::numeric_limits<double>::quiet_NaN()) {
  PaintFinderOptions options;
  options.threshold = threshold;
  return PaintFinder(options);
}

struct Spread {
  double mean_pull = 0.0;
  double rms_pull = 0.0;
  int missed = 0;
};

Spread spread_of_centres(double noise, double spot) {
  constexpr int kSweeps = 3000;
  Sweeps sweeps(noise, spot);
  PaintFinder paint = finder();
  Spread spread;
  for (int i = 0; i < kSweeps; ++i) {
    const double centre = sweeps.uniform(20.0, 120.0);
    const auto lines = paint.find(sweeps.make({centre}));
    if (lines.size() != 1) {
      ++spread.missed;
      continue;
    }
    const double pull = (lines[0].centre() - centre) / lines[0].sigma();
    spread.mean_pull += pull / kSweeps;
    spread.rms_pull += pull * pull / kSweeps;
  }
  spread.rms_pull = std::sqrt(spread.rms_pull);
  return spread;
}

TEST(PaintFinder, SigmaIsTheSpread) {
  for (const double noise : {5.0, 30.0, 80.0}) {
    for (const double spot : {0.4, 0.6, 1.0}) {
      SCOPED_TRACE(testing::Message() << "noise " << noise << ", spot " << spot);
      const Spread spread = spread_of_centres(noise, spot);
      EXPECT_EQ(spread.missed, 0);
      EXPECT_NEAR(spread.mean_pull, 0.0, 0.08);
      EXPECT_GT(spread.rms_pull, 0.7);
      EXPECT_LT(spread.rms_pull, 1.2);
    }
  }
}

TEST(PaintFinder, TheThresholdHardlyMovesTheCentre) {
  // Figure 4 of the report: thresholds of 200 and 550 give centres 0.18 samples apart.
  Sweeps sweeps(20.0);
  PaintFinder low = finder(200.0);
  PaintFinder high = finder(550.0);
  for (int i = 0; i < 500; ++i) {
    const std::vector<double> sweep = sweeps.make({sweeps.uniform(20.0, 120.0)});
    const auto lines = low.find(sweep);
    ASSERT_EQ(lines.size(), 1U);
    ASSERT_EQ(high.find(sweep).size(), 1U);
    EXPECT_NEAR(lines[0].centre(), high.find(sweep)[0].centre(), 0.18);
  }
}

TEST(PaintFinder, FindsBothOfADoubleLineInOrder) {
  Sweeps sweeps(30.0);
  PaintFinder paint = finder();
  for (int i = 0; i < 500; ++i) {
    const double left = sweeps.uniform(20.0, 80.0);
    const auto lines = paint.find(sweeps.make({left, left + 32.0}));
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_NEAR(lines[0].centre(), left, 6 * lines[0].sigma());
    EXPECT_NEAR(lines[1].centre(), left + 32.0, 6 * lines[1].sigma());
  }
}

TEST(PaintFinder, FindsNothingOnBareRoad) {
  Sweeps sweeps(30.0);
  PaintFinder paint = finder();
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(paint.find(sweeps.make({})).empty());
}

TEST(PaintFinder, LeavesOutWhatTheWindowCuts) {
  Sweeps sweeps(10.0);
  PaintFinder paint = finder();
  for (const double centre : {-2.0, 3.0, 7.0, 135.0, 140.0, 144.0}) {
    EXPECT_TRUE(paint.find(sweeps.make({centre})).empty()) << centre;
  }
  EXPECT_EQ(paint.find(sweeps.make({10.0})).size(), 1U);
}

TEST(PaintFinder, LeavesOutLinesOfAnotherWidth) {
  Sweeps sweeps(10.0);
  PaintFinder paint = finder();
  EXPECT_TRUE(paint.find(sweeps.make({70.0}, 4.0)).empty());
  EXPECT_TRUE(paint.find(sweeps.make({70.0}, 30.0)).empty());
  EXPECT_EQ(paint.find(sweeps.make({70.0}, 12.0)).size(), 1U);
}

TEST(PaintFinder, MeasuresWidthAndHeight) {
  Sweeps sweeps(5.0);
  PaintFinder paint = finder();
  const auto lines = paint.find(sweeps.make({70.3}));
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NEAR(lines[0].width(), kWidth, 0.2);
  EXPECT_NEAR(lines[0].height, kHeight, 10.0);
}

TEST(PaintFinder, TakesShortAndBrokenSweeps) {
  PaintFinder paint = finder();
  EXPECT_TRUE(paint.find({}).empty());
  std::vector<double> sweep = Sweeps(10.0).make({70.0});
  EXPECT_TRUE(paint.find(std::span(sweep).first(75)).empty());  // Ends on the line.
  EXPECT_EQ(paint.find(std::span(sweep).first(100)).size(), 1U);
  sweep[3] = NAN;
  EXPECT_TRUE(paint.find(sweep).empty());
}

TEST(PaintFinder, RefusesOptionsThatMeanNothing) {
  PaintFinderOptions options;
  options.width_samples = 0.0;
  EXPECT_THROW(PaintFinder{options}, Error);
  options = {};
  options.width_tolerance = 1.0;
  EXPECT_THROW(PaintFinder{options}, Error);
  options = {};
  options.samples = 2;
  EXPECT_THROW(PaintFinder{options}, Error);
}

}  // namespace
}  // namespace striper
