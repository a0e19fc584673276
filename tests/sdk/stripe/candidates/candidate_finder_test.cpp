// SPDX-License-Identifier: Apache-2.0
// Proves when ridges are looked for instead of the brightest pixels: where a stripe crosses dark
// squares whose scan lines have brighter ones, and not on plain walls, with a stripe or without.
// Does not prove what is chosen among the candidates.
#include "stripe/candidates/candidate_finder.hpp"

#include <cmath>
#include <cstdint>
#include <functional>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "support/random.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper::detail {
namespace {

constexpr int kLines = 320;
constexpr int kLength = 256;
constexpr double kNoise_dn = 1.0;
constexpr double kWidth_px = 1.1;

constexpr WidthModel kWidth{.at_pivot = kWidth_px};

double stripe_at(int line) { return 121.0 + 0.01 * line; }

// DN of pixel k of a scan line.
using Look = std::function<double(int line, int k)>;

double stripe_dn(int line, int k, double amplitude_dn) {
  return testing::box_gaussian(k, stripe_at(line), kWidth_px, amplitude_dn);
}

bool is_on_dark_square(int line) { return line / 40 % 4 == 1; }

// Rows of squares, a fifth as bright where they are dark, which the stripe is there, too.
double board(int line, int k) {
  const bool is_on_board = k > 40 && k < 220;
  const bool is_dark = is_on_dark_square(line) && k > 105 && k < 140;
  const double reflectance = is_on_board && !is_dark ? 1.0 : 0.2;
  return 5.0 + reflectance * (80.0 + stripe_dn(line, k, 160.0));
}

// So bright that four pixels clip: none of them rises above both of those two before and after it.
constexpr WidthModel kNarrow{.at_pivot = 0.8};
double overexposed_board(int line, int k) {
  return board(line, k) + testing::box_gaussian(k, stripe_at(line), 0.75, 2000.0);
}

double shaded_wall(int line, int k) { return 40.0 + 0.2 * k + stripe_dn(line, k, 100.0); }

// Its stripe ends half way.
double half_lit_wall(int line, int k) {
  return 40.0 + 0.2 * k + (line < kLines / 2 ? stripe_dn(line, k, 100.0) : 0.0);
}

LitFrame picture_of(const Look& look, StripeAxis axis) {
  LitFrame frame;
  frame.full_scale_dn = 255;
  frame.lit = cv::Mat(kLength, kLines, CV_8U);
  for (int k = 0; k < kLength; ++k) {
    for (int line = 0; line < kLines; ++line) {
      const double dn = look(line, k) + testing::normal(0.0, kNoise_dn);
      frame.lit.at<std::uint8_t>(k, line) = cv::saturate_cast<std::uint8_t>(dn);
    }
  }
  return axis == StripeAxis::kColumns ? frame : testing::transposed(frame);
}

class Candidates : public ::testing::TestWithParam<StripeAxis> {
 protected:
  Candidates() { options_.axis = GetParam(); }

  void find(const Look& look, bool is_masked = false) {
    frame_ = picture_of(look, options_.axis);
    if (is_masked) {
      frame_.masked = cv::Mat::zeros(frame_.lit.size(), CV_8U);
      frame_.masked(cv::Rect(0, 0, frame_.lit.cols, frame_.lit.rows) &
                    (options_.axis == StripeAxis::kColumns ? cv::Rect(200, 170, 100, 80)
                                                           : cv::Rect(170, 200, 80, 100))) = 255;
    }
    static_cast<void>(part_.cut(frame_, options_.axis, nullptr));
    finder_.begin(frame_);
    finder_.find(at_hand(), part_, kWidth);
  }

  FrameAtHand at_hand() const {
    PlanNoise noise;
    noise.model.read_noise_dn = kNoise_dn;
    return {frame_, options_.axis, images_of(frame_, options_.axis), noise, kNoise_dn, 1.0};
  }

  bool has_stripe(int line) const {
    const auto is_it = [line](const PeakList& peaks, std::size_t i) {
      return peaks.significance[i] > kClearSignificance &&
             std::abs(peaks.position(i) - stripe_at(line)) < 0.5;
    };
    const PeakCandidates& found = finder_.candidates();
    if (is_it(found.primary, static_cast<std::size_t>(line))) return true;
    for (std::size_t i = found.first_secondary(line);
         i < found.secondary.size() && found.secondary.seeds[i].line == line; ++i) {
      if (is_it(found.secondary, i)) return true;
    }
    return false;
  }

  ExtractOptions options_;
  LitFrame frame_;
  SearchedPart part_;
  CandidateFinder finder_{options_};
};

TEST_P(Candidates, AreRidgesOnABoardWithDarkSquares) {
  find(board);
  EXPECT_TRUE(finder_.is_hidden());
  constexpr int kFromBorder = 4;
  for (int line = 0; line < kLines; ++line) {
    const int on_square = line % 40;
    if (on_square < kFromBorder || on_square >= 40 - kFromBorder) continue;
    EXPECT_TRUE(has_stripe(line)) << line << (is_on_dark_square(line) ? ", dark" : ", bright");
  }
}

TEST_P(Candidates, AreMiddlesOfWhatAnOverexposedStripeClips) {
  find(overexposed_board);
  finder_.find_ridges(at_hand(), part_, kNarrow);
  for (int line = 0; line < kLines; ++line) EXPECT_TRUE(has_stripe(line)) << line;
}

TEST_P(Candidates, AreTheBrightestPixelsOfAShadedWall) {
  find(shaded_wall);
  EXPECT_FALSE(finder_.is_hidden());
  for (int line = 0; line < kLines; ++line) EXPECT_TRUE(has_stripe(line)) << line;
}

TEST_P(Candidates, AreTheBrightestPixelsWhereTheStripeEnds) {
  find(half_lit_wall);
  EXPECT_FALSE(finder_.is_hidden());
}

// What is masked has no value: that of the block is 0.
TEST_P(Candidates, AreTheBrightestPixelsBesideMaskedOnes) {
  find(half_lit_wall, true);
  EXPECT_FALSE(finder_.is_hidden());
}

INSTANTIATE_TEST_SUITE_P(CandidateFinder, Candidates,
                         ::testing::Values(StripeAxis::kColumns, StripeAxis::kRows),
                         [](const auto& tested) {
                           return tested.param == StripeAxis::kColumns ? "Columns" : "Rows";
                         });

}  // namespace
}  // namespace striper::detail
