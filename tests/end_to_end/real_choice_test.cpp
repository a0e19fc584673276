// SPDX-License-Identifier: Apache-2.0
// Proves that `ok` means the stripe in real images, without a model: against hand-checked paths
// (support/real_stripe_paths.txt) where there is a laser, and on calibration boards that no laser
// was near, where nothing may be `ok`. Half of the images were learnt from (bench/train_choice.sh).
// Does not prove that the stripe is found wherever it is, nor how exact a position is: the paths
// are good to some pixels.
#include <iostream>
#include <ostream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

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

class BoardsWithoutLaser
    : public ::testing::TestWithParam<std::tuple<const char*, const char*, StripeAxis>> {};

TEST_P(BoardsWithoutLaser, HaveNoOkReturns) {
  const auto [set, extension, axis] = GetParam();
  STRIPER_SKIP_WITHOUT_REAL_DATA(set);
  RealScanner scanner({});
  RealScore sum;
  for (const RealImage& image : testing::real_boards(set, extension, axis)) {
    const RealScore score = scanner.score(image);
    if (score.ok > 0) std::cout << fmt::format("{}: {} ok\n", image.file, score.ok);
    sum.add(score);
  }
  EXPECT_LE(percent(sum.ok, sum.lines), 0.5);
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
};
void PrintTo(const LaserSet& set, std::ostream* out) { *out << set.set; }

class ImagesWithLaser : public ::testing::TestWithParam<LaserSet> {};

RealScore score_of_set(const std::string& set, PeakRule peak) {
  RealScanner scanner({.peak = peak});
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
    const RealScore sum = score_of_set(set.set, peak);
    const double found = percent(sum.found, sum.with_stripe);
    const double wrong = percent(sum.wrong, sum.judged());
    std::cout << fmt::format("found {:.1f} %, wrong {:.2f} %\n", found, wrong);
    EXPECT_LE(wrong, 2.0);
    EXPECT_GE(found, set.found_percent);
  }
}

INSTANTIATE_TEST_SUITE_P(Real, ImagesWithLaser,
                         ::testing::Values(LaserSet{"neil-rover-striper", 93.0},
                                           LaserSet{"blaser-cmu", 90.0},
                                           LaserSet{"b33-handheld-known-distance", 99.0},
                                           LaserSet{"anugrah-step-scans", 96.5},
                                           LaserSet{"srv-green-laser-turntable", 90.0}));

}  // namespace
}  // namespace striper
