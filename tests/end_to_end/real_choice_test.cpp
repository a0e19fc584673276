// SPDX-License-Identifier: Apache-2.0
// Proves that `ok` means the stripe in real images, without a model and where it is told how wide
// and high the stripe is: against hand-checked paths (support/real_stripe_paths.txt) where there is
// a laser, and on calibration boards that no laser was near, where nothing may be `ok`. Half of the
// images were learnt from (bench/train_choice.sh). Does not prove that the stripe is found wherever
// it is, nor how exact a position is: the paths are good to some pixels.
#include <algorithm>
#include <iostream>
#include <ostream>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <striper/stripe/expected_stripe.hpp>

#include "support/instrumented.hpp"
#include "support/real_stripe.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using testing::RealImage;
using testing::RealScanner;
using testing::RealScore;

double percent(std::size_t part, std::size_t whole) {
  return 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

using Boards = std::tuple<const char*, const char*, StripeAxis>;

// Percent of their scan lines that are `ok`.
double ok_percent(const Boards& boards, const std::vector<ExpectedStripe>& expected) {
  const auto& [set, extension, axis] = boards;
  RealScanner scanner({.expected = expected});
  RealScore sum;
  for (const RealImage& image : testing::real_boards(set, extension, axis)) {
    const RealScore score = scanner.score(image);
    if (score.ok > 0) std::cout << fmt::format("{}: {} ok\n", image.file, score.ok);
    sum.add(score);
  }
  return percent(sum.ok, sum.lines);
}

class BoardsWithoutLaser : public ::testing::TestWithParam<Boards> {};

TEST_P(BoardsWithoutLaser, HaveNoOkReturns) {
  STRIPER_SKIP_WITHOUT_REAL_DATA(std::get<0>(GetParam()));
  EXPECT_LE(ok_percent(GetParam(), {}), 0.5);
}

TEST_P(BoardsWithoutLaser, HaveNoOkReturnsWhereALookIsTold) {
  STRIPER_SKIP_FIGURES_WHERE_INSTRUMENTED();
  STRIPER_SKIP_WITHOUT_REAL_DATA(std::get<0>(GetParam()));
  for (const double sigma_px : {1.5, 3.0, 5.0}) {
    const ExpectedStripe look = testing::stripe_of_look(sigma_px, 150.0F);
    EXPECT_LE(ok_percent(GetParam(), {look}), 0.5) << sigma_px;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Real, BoardsWithoutLaser,
    ::testing::Values(std::tuple("bouguet-calib-example", ".tif", StripeAxis::kColumns),
                      std::tuple("bouguet-calib-example", ".tif", StripeAxis::kRows),
                      std::tuple("opencv-left-right", ".jpg", StripeAxis::kColumns),
                      std::tuple("opencv-left-right", ".jpg", StripeAxis::kRows)));

struct LaserSet {
  const char* set;
  double found_percent;  // Of the scan lines with a stripe, at least.
  double sigma_px;       // How wide and high most of the stripe is.
  float amplitude_dn;
};
void PrintTo(const LaserSet& set, std::ostream* out) { *out << set.set; }

class ImagesWithLaser : public ::testing::TestWithParam<LaserSet> {};

RealScore score_of_set(const std::string& set, const testing::RealSettings& settings) {
  RealScanner scanner(settings);
  RealScore sum;
  for (const RealImage& image : testing::real_images()) {
    if (image.set() == set) sum.add(scanner.score(image));
  }
  return sum;
}

TEST_P(ImagesWithLaser, HaveTheirStripeOkAndNothingElse) {
  const LaserSet set = GetParam();
  STRIPER_SKIP_WITHOUT_REAL_DATA(set.set);
  for (const PeakRule peak : {PeakRule::kBrightest, PeakRule::kContinuous}) {
    const RealScore sum = score_of_set(set.set, {.peak = peak});
    const double found = percent(sum.found, sum.with_stripe);
    const double wrong = percent(sum.wrong, sum.judged());
    std::cout << fmt::format("found {:.1f} %, wrong {:.2f} %\n", found, wrong);
    EXPECT_LE(wrong, 2.0);
    EXPECT_GE(found, set.found_percent);
  }
}

TEST_P(ImagesWithLaser, HaveTheirStripeOkAndNothingElseWhereItsLookIsTold) {
  const LaserSet set = GetParam();
  STRIPER_SKIP_WITHOUT_REAL_DATA(set.set);
  const RealScore without = score_of_set(set.set, {});
  const RealScore sum = score_of_set(
      set.set, {.expected = {testing::stripe_of_look(set.sigma_px, set.amplitude_dn)}});
  const double found = percent(sum.found, sum.with_stripe);
  const double wrong = percent(sum.wrong, sum.judged());
  std::cout << fmt::format("found {:.1f} %, wrong {:.2f} %\n", found, wrong);
  EXPECT_LE(wrong, percent(without.wrong, without.judged()) + 0.6);
  EXPECT_GE(found, std::max(90.0, set.found_percent - 2.0));
}

INSTANTIATE_TEST_SUITE_P(
    Real, ImagesWithLaser,
    ::testing::Values(LaserSet{"neil-rover-striper", 93.0, 1.7, 115.0F},
                      LaserSet{"blaser-cmu", 90.0, 3.9, 325.0F},
                      LaserSet{"b33-handheld-known-distance", 99.0, 1.4, 243.0F},
                      LaserSet{"anugrah-step-scans", 96.5, 1.8, 1170.0F},
                      LaserSet{"srv-green-laser-turntable", 90.0, 1.1, 90.0F}));

}  // namespace
}  // namespace striper
