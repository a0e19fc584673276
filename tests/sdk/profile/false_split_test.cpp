// SPDX-License-Identifier: Apache-2.0
// Proves that a scan of one straight line is cut as often as stated, with gross outliers too. Flat
// scenes alone: what is found of real corners is in segments_test.cpp.
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include <striper/profile/segments.hpp>

#include "support/profile_scans.hpp"

namespace striper {
namespace {

#ifdef STRIPER_FULL_TRIALS
constexpr int kScans = 200000;
constexpr double kRate = 1e-3;
#else
constexpr int kScans = 4000;  // At ten times the rate, so that there is something to count.
constexpr double kRate = 1e-2;
#endif

double false_splits(double outliers, int columns) {
  testing::ProfileStriper striper;
  striper.columns = columns;
  SegmentOptions options;
  options.false_split_rate = kRate;
  Segmenter segmenter(options);
  Segmentation found;
  PolarScan scan;
  int split = 0;
  for (int k = 0; k < kScans; ++k) {
    if (k % 100 == 0) testing::reseed(static_cast<std::uint64_t>(k));
    const auto ranges = testing::exact_ranges(striper, [&](double bearing_rad) {
      return testing::range_of_line(bearing_rad, 0.008 * (k % 100) - 0.4, 1.0 + 0.01 * (k % 200));
    });
    testing::noisy_scan(striper, ranges, scan);
    testing::add_gross_outliers(striper, outliers, scan);
    segmenter.segment(scan, found);
    split += found.pieces.size() != 1 ? 1 : 0;
  }
  return static_cast<double>(split) / kScans;
}

// 200000 scans know a rate of 1e-3 to 7 %; 4000 one of 1e-2 to 16 %, which is added.
constexpr double kChance = kScans < 10000 ? 1.4 : 1.0;

void expect_rate(double rate) {
  ::testing::Test::RecordProperty("false_splits", std::to_string(rate));
  EXPECT_LT(rate, 1.5 * kChance * kRate);
  EXPECT_GT(rate, kRate / (1.5 * kChance));
}

TEST(FalseSplits, OfOneStraightLineAreAsRareAsStated) { expect_rate(false_splits(0.0, 640)); }

TEST(FalseSplits, WithGrossOutliersToo) { expect_rate(false_splits(0.02, 640)); }

TEST(FalseSplits, OfShortScansToo) { expect_rate(false_splits(0.0, 160)); }

}  // namespace
}  // namespace striper
