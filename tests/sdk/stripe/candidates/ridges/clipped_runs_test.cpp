// SPDX-License-Identifier: Apache-2.0
// Proves which runs of clipped pixels become ridges: their middle and rise, along both axes, in 8
// and 16 bits, with a dark image; and none that is too long, hardly rises, or is masked. Does not
// prove that they are the stripe.
#include "stripe/candidates/ridges/clipped_runs.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "support/synthetic_stripe.hpp"

namespace striper::detail {
namespace {

constexpr int kLines = 20;
constexpr int kLength = 90;
constexpr int kDistance = 2;
constexpr ClippedRuns::Limits kLimits{kDistance, 6, 10};
constexpr int kLine = 7;  // The one that has something.

struct Case {
  std::string name;
  StripeAxis axis = StripeAxis::kColumns;
  int type = CV_8U;
  bool has_dark = false;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Runs : public ::testing::TestWithParam<Case> {
 protected:
  Runs() {
    frame_.full_scale_dn = full();
    frame_.lit = cv::Mat(kLength, kLines, GetParam().type, cv::Scalar(background()));
    if (GetParam().has_dark) frame_.dark = cv::Mat(kLength, kLines, GetParam().type, dark());
    frame_.masked = cv::Mat::zeros(kLength, kLines, CV_8U);
  }

  int full() const { return GetParam().type == CV_8U ? 255 : 4095; }
  int background() const { return full() / 4; }
  int dark() const { return GetParam().has_dark ? full() / 8 : 0; }

  void clip(int first, int last) { frame_.lit(cv::Range(first, last + 1), column()) = full(); }
  void mask(int k) { frame_.masked(cv::Range(k, k + 1), column()) = 255; }

  // Those of the line, in order.
  std::vector<Ridges::Ridge> found(const ClippedRuns::Limits& limits = kLimits) {
    const bool is_columns = GetParam().axis == StripeAxis::kColumns;
    const LitFrame frame = is_columns ? frame_ : testing::transposed(frame_);
    const cv::Mat image = frame.dark.empty() ? frame.lit : cv::Mat(frame.lit - frame.dark);
    ridges_.find(image, GetParam().axis, kDistance, limits.least_dn);
    runs_.add_to(ridges_, frame, GetParam().axis, limits);
    for (int line = 0; line < kLines; ++line) {
      if (line == kLine) continue;
      EXPECT_TRUE(ridges_.of_line(line).empty()) << line;
    }
    const auto of_line = ridges_.of_line(kLine);
    std::vector<Ridges::Ridge> ridges(of_line.begin(), of_line.end());
    std::sort(ridges.begin(), ridges.end(),
              [](const auto& a, const auto& b) { return a.across < b.across; });
    return ridges;
  }

  LitFrame frame_;

 private:
  static cv::Range column() { return {kLine, kLine + 1}; }

  Ridges ridges_;
  ClippedRuns runs_;
};

TEST_P(Runs, AreOneRidgeEachInTheirMiddle) {
  clip(20, 22);  // A ridge by itself; the others are none.
  clip(40, 43);
  clip(60, 65);
  const std::vector<Ridges::Ridge> ridges = found();
  ASSERT_EQ(ridges.size(), 3U);
  EXPECT_EQ(ridges[0].across, 21);
  EXPECT_EQ(ridges[1].across, 41);
  EXPECT_EQ(ridges[2].across, 62);
  for (const Ridges::Ridge& ridge : ridges) EXPECT_EQ(ridge.rise_dn, full() - background());
}

TEST_P(Runs, AreNoneWhereTheyAreTooLongOrHardlyRise) {
  clip(30, 36);
  EXPECT_TRUE(found().empty());
  EXPECT_EQ(found({kDistance, 7, 10}).size(), 1U);
  EXPECT_TRUE(found({kDistance, 7, full() - background() + 1}).empty());
}

TEST_P(Runs, AreNoneOfMaskedPixels) {
  clip(30, 33);
  for (int k = 30; k <= 33; ++k) mask(k);
  EXPECT_TRUE(found().empty());
}

TEST_P(Runs, OfTheBorderAreComparedWithTheOneSideThatThereIs) {
  clip(0, 4);
  clip(kLength - 4, kLength - 1);
  const std::vector<Ridges::Ridge> ridges = found();
  ASSERT_EQ(ridges.size(), 2U);
  EXPECT_EQ(ridges[0].across, 2);
  EXPECT_EQ(ridges[1].across, kLength - 3);
}

// A scan line keeps its highest ridges, however many there are.
TEST_P(Runs, DriveOutLowerRidges) {
  const int low = background() + 20;
  for (int k = 5; k < 5 + 3 * static_cast<int>(Ridges::kMost); k += 3) {
    frame_.lit(cv::Range(k, k + 1), cv::Range(kLine, kLine + 1)) = low;
  }
  clip(82, 86);
  const std::vector<Ridges::Ridge> ridges = found();
  ASSERT_EQ(ridges.size(), Ridges::kMost);
  EXPECT_EQ(ridges.back().across, 84);
}

INSTANTIATE_TEST_SUITE_P(ClippedRuns, Runs,
                         ::testing::Values(Case{"Columns"}, Case{"Rows", StripeAxis::kRows},
                                           Case{"Columns16", StripeAxis::kColumns, CV_16U},
                                           Case{"Rows16Dark", StripeAxis::kRows, CV_16U, true},
                                           Case{"ColumnsDark", StripeAxis::kColumns, CV_8U, true}),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace striper::detail
