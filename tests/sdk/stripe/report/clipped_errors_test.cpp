// SPDX-License-Identifier: Apache-2.0
// Proves that the errors of clipped returns that are doubted are widened, and no others; that none
// is narrowed; and that beside a board's squares, where such returns are off by several of their
// sigmas, they are not then. Does not prove it of scenes: stripe_choice_test.cpp says how many of
// what is sure are right there.
#include "stripe/report/clipped_errors.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "stripe/profile_extractor.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

constexpr int kLines = 400;
constexpr int kLength = 360;
constexpr double kSquare_px = 31.0;
constexpr double kWidth_px = 3.4;
constexpr double kWhite_dn = 185.0;
constexpr double kStripe_dn = 230.0;  // On white: it clips there, not on black.
constexpr double kBlack = 0.09;       // Of white.
constexpr double kNoise_dn = 3.0;
constexpr int kBoards = 6;

double stripe_at(int board, double line) { return 140.0 + 3.0 * board + 0.05 * (board + 1) * line; }

double reflectance_at(double along, double across) {
  const auto column = static_cast<int>(std::floor((along + 0.1 * across) / kSquare_px));
  const auto row = static_cast<int>(std::floor((across - 0.1 * along + 155.0) / kSquare_px));
  return (column + row) % 2 == 0 ? 1.0 : kBlack;
}

LitFrame board(int number) {
  constexpr int kParts = 4;
  LitFrame frame;
  frame.full_scale_dn = 255;
  frame.lit = cv::Mat(kLength, kLines, CV_8U);
  for (int line = 0; line < kLines; ++line) {
    for (int pixel = 0; pixel < kLength; ++pixel) {
      double sum = 0.0;
      for (int part = 0; part < kParts * kParts; ++part) {
        const int right = part / kParts;
        const int down = part % kParts;
        const double x = line + 2.0 * ((right + 0.5) / kParts - 0.5);
        const double y = pixel + 2.0 * ((down + 0.5) / kParts - 0.5);
        const double off = (y - stripe_at(number, line)) / kWidth_px;
        sum += reflectance_at(x, y) * (kWhite_dn + kStripe_dn * std::exp(-0.5 * off * off));
      }
      const double dn = 5.0 + sum / (kParts * kParts);
      frame.lit.at<std::uint8_t>(pixel, line) =
          cv::saturate_cast<std::uint8_t>(testing::normal(dn, kNoise_dn));
    }
  }
  return frame;
}

// Of one board.
struct Extracted {
  explicit Extracted(int number) : extractor(options()) {
    extractor.extract(board(number), stripe);
  }

  static ExtractOptions options() {
    ExtractOptions options;
    options.stripe_sigma_px = kWidth_px;
    options.min_confidence = 0.0;
    return options;
  }
  bool is_clipped(std::size_t line) const {
    const StripeChoice& choice = extractor.choice();
    const std::int32_t chosen = choice.of_line(static_cast<int>(line)).candidate;
    return choice.pieces().candidate(static_cast<std::size_t>(chosen)).is_clipped;
  }
  ReturnEvidence::Measured measured() const { return {extractor.choice(), extractor.edges()}; }

  ProfileExtractor extractor;
  Stripe stripe;
};

// Once more than the extractor did.
TEST(ClippedErrors, WidenWhatIsClippedAndDoubtedAndNothingElse) {
  testing::reseed();
  int widened = 0;
  int sure = 0;
  int unclipped = 0;
  for (int number = 0; number < kBoards; ++number) {
    const Extracted of(number);
    ReturnEvidence evidence;
    evidence.look_at(of.measured(), of.stripe);
    ReturnConfidence alone;
    alone.begin(of.stripe.size());
    alone.rate_alone(evidence, of.measured(), of.stripe);
    Stripe wider = of.stripe;
    ClippedErrors().widen(evidence, of.measured(), alone, wider);
    for (const std::size_t line : evidence.returns()) {
      const float by = wider.sigma_px[line] / of.stripe.sigma_px[line];
      const bool is_doubted = *alone.of_line(line) < kSure;
      const bool is_widened = of.is_clipped(line) && is_doubted;
      const Evidence e = evidence.of(of.measured(), of.stripe, line);
      EXPECT_NEAR(by, is_widened ? ClippedErrors::factor(e) : 1.0F, 1e-3F * by) << line;
      EXPECT_GE(by, 0.9999F) << line;
      widened += static_cast<int>(by > 1.1F);
      sure += static_cast<int>(of.is_clipped(line) && !is_doubted);
      unclipped += static_cast<int>(!of.is_clipped(line) && is_doubted);
    }
  }
  EXPECT_GT(widened, 20);
  EXPECT_GT(sure, 20);
  EXPECT_GT(unclipped, 20);
}

// As they were reckoned, 240 of 1291 are beyond.
TEST(ClippedErrors, HoldWhereEdgesMoveClippedReturns) {
  testing::reseed();
  int doubted = 0;
  int beyond = 0;
  for (int number = 0; number < kBoards; ++number) {
    const Extracted of(number);
    for (std::size_t line = 0; line < of.stripe.size(); ++line) {
      const int at = static_cast<int>(line);
      const bool is_any = of.extractor.choice().of_line(at).candidate >= 0;
      if (!is_any || !std::isfinite(of.stripe.across_px[line]) || of.extractor.is_bridged(at))
        continue;
      const float alone = logistic(of.extractor.evidence(of.stripe, at).of[Evidence::kFourth]);
      const double off = std::abs(of.stripe.across_px[line] - stripe_at(number, at));
      if (!of.is_clipped(line) || alone >= kSure || off > 2.0 * kWidth_px) continue;
      ++doubted;
      beyond += static_cast<int>(off > 3.0 * static_cast<double>(of.stripe.sigma_px[line]));
    }
  }
  std::cout << doubted << " doubted, " << beyond << " beyond 3 sigmas\n";
  EXPECT_GT(doubted, 100);
  EXPECT_LT(beyond, doubted / 25);
}

}  // namespace
}  // namespace striper::detail
