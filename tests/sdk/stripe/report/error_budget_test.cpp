// SPDX-License-Identifier: Apache-2.0
// Proves that the sigma of what edges, textures and clipping add up to has a limit, that some
// returns come to it, and that no `ok` return is farther off than three of it. Does not prove that
// errors are true below it: stripe_error_bars_test.cpp does.
#include "stripe/report/error_budget.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "stripe/profile_extractor.hpp"
#include "stripe/report/sigma_limit.hpp"
#include "support/board_under_stripe.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

constexpr int kBoards = 12;
constexpr double kWidth_px = 2.6;

testing::BoardUnderStripe board(int number) {
  return {.lines = 400,
          .length_px = 360,
          .square_px = 17.0,
          .turn = 0.2,
          .origin_px = 155.0,
          .first_px = 140.0 + 3.0 * number,
          .slope = 0.04 * (number + 1),
          .width_px = kWidth_px,
          .white_dn = 140.0,
          .stripe_dn = 60.0 + 15.0 * number,  // Most clip on white.
          .black = 0.09,
          .blur_px = 1.0,
          .noise_dn = 3.0};
}

TEST(ErrorBudget, IsAtMostThatOfWhatIsNear) {
  testing::reseed();
  int at_most = 0;
  int ok = 0;
  for (int number = 0; number < kBoards; ++number) {
    ExtractOptions options;
    options.stripe_sigma_px = kWidth_px;
    ProfileExtractor extractor(options);
    LitFrame frame;
    frame.lit = testing::draw(board(number));
    frame.full_scale_dn = 255;
    Stripe stripe;
    extractor.extract(frame, stripe);
    for (std::size_t line = 0; line < stripe.size(); ++line) {
      if (!std::isfinite(stripe.across_px[line])) continue;
      const int at = static_cast<int>(line);
      const std::int32_t chosen = extractor.choice().of_line(at).candidate;
      if (chosen < 0 || extractor.is_bridged(at)) continue;
      const auto sigma = static_cast<double>(stripe.sigma_px[line]);
      const auto most = static_cast<double>(sigma_limit_px(extractor.choice(), chosen, 1.0));
      EXPECT_LE(sigma, 1.0001 * most) << number << " " << line;
      at_most += static_cast<int>(sigma > 0.9999 * most);
      if (stripe.status[line] != ReturnStatus::kOk) continue;
      ++ok;
      const double truth = testing::stripe_at(board(number), at);
      EXPECT_LT(std::abs(stripe.across_px[line] - truth), 3.0 * most) << number << " " << line;
    }
  }
  EXPECT_GT(at_most, 20);
  EXPECT_GT(ok, kBoards * 100);
}

}  // namespace
}  // namespace striper::detail
