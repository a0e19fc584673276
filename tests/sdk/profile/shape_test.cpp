// SPDX-License-Identifier: Apache-2.0
// Proves that averaging gains what independent scans give, with true bars, and refuses what moves;
// that resampling puts returns on the grid, on the surface, and fills gaps only when asked.
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/profile/average.hpp>
#include <striper/profile/resample.hpp>
#include <striper/stream/shaped_sink.hpp>

#include "support/error_of.hpp"
#include "support/models.hpp"
#include "support/profile_scans.hpp"
#include "support/sinks.hpp"

namespace striper {
namespace {

using testing::ProfileStriper;
using testing::range_of_line;
using testing::Rms;

std::vector<double> wall(const ProfileStriper& striper) {
  return testing::exact_ranges(striper, [](double b) { return range_of_line(b, 0.1, 1.5); });
}

TEST(ScanAverager, GainsTheRootOfItsScansWithTrueBars) {
  const ProfileStriper striper;
  const auto ranges = wall(striper);
  ScanAverager averager(16);
  PolarScan scan;
  Rms gain, pull;
  for (int k = 0; k < 160; ++k) {
    testing::noisy_scan(striper, ranges, scan);
    scan.sequence = static_cast<std::uint64_t>(k);
    const PolarScan* const mean = averager.add(scan);
    ASSERT_EQ(mean != nullptr, k % 16 == 15);
    if (mean == nullptr) continue;
    EXPECT_EQ(mean->sequence, static_cast<std::uint64_t>(k - 7));  // Of the middle.
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      ASSERT_EQ(mean->returns[i].status, ReturnStatus::kOk);
      gain.add((mean->returns[i].range_m - ranges[i]) / striper.sigma_m(i, ranges[i]));
      pull.add((mean->returns[i].range_m - ranges[i]) / mean->returns[i].sigma_m);
    }
  }
  EXPECT_NEAR(gain.value(), 0.25, 0.01);
  EXPECT_NEAR(pull.value(), 1.0, 0.05);
  EXPECT_EQ(averager.moved(), 0U);
  EXPECT_EQ(averager.finish(), nullptr);
}

TEST(ScanAverager, StampsTheMiddleWhateverTheirNumber) {
  const ProfileStriper striper;
  PolarScan scan;
  testing::noisy_scan(striper, wall(striper), scan);
  ScanAverager averager(4);
  const auto add = [&](std::uint64_t sequence, std::int64_t monotonic_ns) {
    scan.sequence = sequence;
    scan.time.monotonic_ns = monotonic_ns;
    return averager.add(scan);
  };
  const PolarScan* mean = nullptr;
  for (int k = 0; k < 4; ++k) mean = add(10U + static_cast<std::uint64_t>(k), 1000 * k);
  ASSERT_NE(mean, nullptr);
  EXPECT_EQ(mean->sequence, 12U);
  EXPECT_EQ(mean->time.monotonic_ns, 1500);
  EXPECT_EQ(averager.incomplete(), 0U);
  for (int k = 0; k < 3; ++k) add(20U + static_cast<std::uint64_t>(k), 5000 + 1000 * k);
  mean = averager.finish();
  ASSERT_NE(mean, nullptr);
  EXPECT_EQ(mean->sequence, 21U);
  EXPECT_EQ(mean->time.monotonic_ns, 6000);
  EXPECT_EQ(averager.incomplete(), 1U);
}

TEST(ScanAverager, HeadsAreApartAndOtherScanLinesRefused) {
  const ProfileStriper striper;
  PolarScan scan;
  testing::noisy_scan(striper, wall(striper), scan);
  ScanAverager averager(2);
  EXPECT_EQ(averager.add(scan), nullptr);
  PolarScan right = scan;
  ScanFrame frame;
  frame.head = "right";
  right.frame = std::make_shared<const ScanFrame>(frame);
  EXPECT_EQ(averager.add(right), nullptr);
  scan.returns.erase(scan.returns.begin() + 5);
  EXPECT_EQ(testing::error_of([&] { averager.add(scan); }).kind(), ErrorKind::kUsage);
}

TEST(ScanAverager, WhatMovesIsRefused) {
  const ProfileStriper striper;
  auto ranges = wall(striper);
  ScanAverager averager(10);
  PolarScan scan;
  const PolarScan* mean = nullptr;
  for (int k = 0; k < 10; ++k) {
    for (std::size_t i = 300; i < 400; ++i) ranges[i] = 1.0 + 0.01 * k;
    testing::noisy_scan(striper, ranges, scan);
    mean = averager.add(scan);
  }
  ASSERT_NE(mean, nullptr);
  for (std::size_t i = 0; i < ranges.size(); ++i)
    EXPECT_EQ(mean->returns[i].status == ReturnStatus::kOk, i < 300 || i >= 400) << i;
  EXPECT_EQ(averager.moved(), 100U);
}

TEST(ScanAverager, WhatIsLeftOverComesAtTheEnd) {
  const ProfileStriper striper;
  ScanAverager averager(4);
  PolarScan scan;
  testing::noisy_scan(striper, wall(striper), scan);
  EXPECT_EQ(averager.add(scan), nullptr);
  scan.returns[7].status = ReturnStatus::kWeak;
  EXPECT_EQ(averager.add(scan), nullptr);
  scan.returns[7].status = ReturnStatus::kWeak;
  scan.laser = 1;
  EXPECT_EQ(averager.add(scan), nullptr);
  const PolarScan* const first = averager.finish();
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->laser, 0);
  EXPECT_EQ(first->returns[7].status, ReturnStatus::kOk);  // In one of two.
  const PolarScan* const second = averager.finish();
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(second->returns[7].status, ReturnStatus::kWeak);
  EXPECT_EQ(averager.finish(), nullptr);
  EXPECT_STREQ(testing::error_of([] { ScanAverager none(0); }).what(),
               "average is 0; expected 1 to 10000");
}

// A board in front of a wall, exactly; `hole` columns without a return.
PolarScan board(std::size_t hole_from, std::size_t hole_to) {
  const ProfileStriper striper;
  PolarScan scan;
  for (std::size_t i = 0; i < 640; ++i) {
    const double b = striper.bearing_rad(i);
    const double near = range_of_line(b, 0.0, 1.5);
    const bool is_board = std::abs(near * std::sin(b)) < 0.2;
    const bool is_hole = i >= hole_from && i < hole_to;
    scan.returns.push_back(testing::return_at(striper, i,
                                              is_hole    ? Return::kNone
                                              : is_board ? near
                                                         : range_of_line(b, 0.0, 2.0)));
  }
  return scan;
}

TEST(Resampled, ReturnsAreOnTheGridAndOnTheSurface) {
  const PolarScan out = resampled(board(0, 0), parse_resample_grid("y=0.002"));
  ASSERT_GT(out.returns.size(), 800U);
  for (const Return& r : out.returns) {
    EXPECT_NEAR(r.y_m / 0.002, std::round(r.y_m / 0.002), 1e-6);
    EXPECT_LT(std::min(std::abs(r.x_m - 1.5), std::abs(r.x_m - 2.0)), 1e-9);
    EXPECT_EQ(r.status, ReturnStatus::kOk);
  }
}

TEST(Resampled, BearingsAreWholeMultiples) {
  const PolarScan out = resampled(board(0, 0), parse_resample_grid("bearing=0.25"));
  const double step = 0.25 * std::numbers::pi / 180.0;
  EXPECT_NEAR(static_cast<double>(out.returns.size()), 219.0, 3.0);
  for (const Return& r : out.returns) {
    EXPECT_NEAR(r.bearing_rad / step, std::round(r.bearing_rad / step), 1e-9);
    EXPECT_LT(std::min(std::abs(r.x_m - 1.5), std::abs(r.x_m - 2.0)), 1e-9);
  }
}

TEST(Resampled, GapsAreFilledOnlyWhenAsked) {
  const ResampleGrid grid = parse_resample_grid("y=0.002");
  const PolarScan scan = board(320, 330);  // 24 mm of the board.
  const auto filled = [&](std::optional<double> most) {
    int count = 0;
    for (const Return& r : resampled(scan, grid, most).returns) {
      if (r.status != ReturnStatus::kFilled) continue;
      ++count;
      EXPECT_NEAR(r.x_m, 1.5, 1e-9);
    }
    return count;
  };
  EXPECT_EQ(filled(std::nullopt), 0);
  EXPECT_EQ(filled(0.01), 0);
  EXPECT_NEAR(filled(0.05), 12, 1);
  int deep = 0;  // The edges of the board too.
  for (const Return& r : resampled(scan, grid, 1.0).returns)
    deep += r.status == ReturnStatus::kFilled && r.sigma_m > 0.1 ? 1 : 0;
  EXPECT_GT(deep, 0);
}

TEST(Resampled, TablesOfOkReturnsHaveTheSameHoles) {
  const ResampleGrid grid = parse_resample_grid("y=0.002");
  PolarScan scan = board(320, 323);
  const std::size_t with_all = resampled(scan, grid).returns.size();
  std::erase_if(scan.returns, [](const Return& r) { return r.status != ReturnStatus::kOk; });
  ASSERT_EQ(scan.returns.size(), 637U);
  EXPECT_EQ(resampled(scan, grid).returns.size(), with_all);
  for (Return& r : scan.returns) r.u_px = Return::kNone;  // Nothing says that there is a hole.
  EXPECT_GT(resampled(scan, grid).returns.size(), with_all);
  // Half of the pixels: the pitch is two.
  PolarScan binned = board(0, 0);
  for (std::size_t i = 0; i < binned.returns.size(); ++i)
    if (i % 2 == 1) binned.returns[i].status = ReturnStatus::kNoStripe;
  std::erase_if(binned.returns, [](const Return& r) { return r.status != ReturnStatus::kOk; });
  EXPECT_GT(resampled(binned, grid).returns.size(), 800U);
}

// A return on a bearing of its own, of a scan line.
Return point(double u_px, double bearing_rad, double range_m) {
  Return r;
  r.u_px = u_px;
  r.v_px = 100.3;
  r.bearing_rad = bearing_rad;
  r.range_m = range_m;
  r.sigma_m = 5e-4;
  r.x_m = range_m * std::cos(bearing_rad);
  r.y_m = range_m * std::sin(bearing_rad);
  r.status = ReturnStatus::kOk;
  return r;
}

TEST(Resampled, NothingIsBetweenASpikeOrAPairAndWhatIsBehind) {
  const ResampleGrid grid = parse_resample_grid("y=0.0005");
  PolarScan spike = board(0, 0);
  spike.returns[320] = testing::return_at(ProfileStriper{}, 320, 1.0);
  for (const Return& r : resampled(spike, grid).returns) EXPECT_GT(r.range_m, 1.4);
  PolarScan pair;
  pair.returns = {point(250, 0.01, 2.0), point(251, 0.008, 1.0)};
  EXPECT_TRUE(resampled(pair, grid).returns.empty());
  PolarScan sparse;
  sparse.returns = {point(20, 0.4, 2.0), point(300, 0.0, 2.0), point(580, -0.4, 2.0)};
  EXPECT_TRUE(resampled(sparse, grid).returns.empty());
}

TEST(Resampled, BearingsGoOnBeyondHalfATurn) {
  PolarScan ring;
  for (int i = 0; i < 360; ++i)
    ring.returns.push_back(
        point(i, std::remainder(i * std::numbers::pi / 180.0, 2.0 * std::numbers::pi), 2.0));
  const PolarScan out = resampled(ring, parse_resample_grid("bearing=0.5"));
  EXPECT_EQ(out.returns.size(), 719U);
  for (const Return& r : out.returns) EXPECT_NEAR(r.range_m, 2.0, 1e-3);
}

TEST(Resampled, OnceMoreChangesNothing) {
  const ResampleGrid grid = parse_resample_grid("y=0.002");
  const PolarScan once = resampled(board(320, 323), grid);
  const PolarScan twice = resampled(once, grid);
  ASSERT_EQ(twice.returns.size(), once.returns.size());
  for (std::size_t i = 0; i < once.returns.size(); ++i)
    EXPECT_NEAR(twice.returns[i].range_m, once.returns[i].range_m, 1e-9);
}

TEST(Resampled, SeveralReturnsOfAScanLineAreRefused) {
  PolarScan scan = board(0, 0);
  scan.returns[11].u_px = scan.returns[10].u_px;
  EXPECT_NE(std::string(
                testing::error_of([&] { resampled(scan, parse_resample_grid("y=0.002")); }).what())
                .find("several returns in one scan line (pixel 10)"),
            std::string::npos);
}

// What comes out of a scan that is smoothed by the models with which its head was opened, one after
// another.
PolarScan smoothed_by(const std::vector<StriperModel>& models, const PolarScan& scan) {
  PolarScan last;
  ShapeOptions options;
  options.smooth = true;
  const auto sink = shaped_sink(
      std::make_unique<testing::SinkThat>([&](const PolarScan& shaped) { last = shaped; }),
      options);
  for (const StriperModel& model : models) {
    sink->open(head_info(kDefaultHead, {}, std::make_shared<StriperModel>(model), model.axis));
    sink->write(scan);
  }
  return last;
}

TEST(ShapedSink, HeadThatOpensAgainIsSmoothedByItsNewModel) {
  const ProfileStriper striper;
  PolarScan scan;
  testing::reseed(7);
  testing::noisy_scan(striper, wall(striper), scan);
  const StriperModel straight = testing::paper_model();
  const StriperModel tilted = testing::typical_model();
  const PolarScan anew = smoothed_by({straight, tilted}, scan);
  const PolarScan alone = smoothed_by({tilted}, scan);
  const PolarScan before = smoothed_by({straight}, scan);
  ASSERT_EQ(anew.returns.size(), alone.returns.size());
  EXPECT_EQ(anew.returns[320].range_m, alone.returns[320].range_m);
  EXPECT_NE(anew.returns[320].range_m, before.returns[320].range_m);
}

TEST(ResampleGrid, NonsenseIsRefused) {
  for (const char* text : {"z=1", "x", "x=0", "y=1e-9", "bearing=1e-4", "bearing=-1", "y=1m"})
    EXPECT_NE(std::string(testing::error_of([&] { parse_resample_grid(text); }).what())
                  .find("expected x=M or y=M, a step of 1e-5 metres or more, or bearing=DEG"),
              std::string::npos);
  ShapeOptions options;
  options.fill_gaps_m = 0.1;
  EXPECT_STREQ(testing::error_of([&] { options.validate(); }).what(),
               "gaps are filled where a scan is resampled: say to what by resample (--resample)");
}

}  // namespace
}  // namespace striper
