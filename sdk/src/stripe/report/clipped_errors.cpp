// SPDX-License-Identifier: Apache-2.0
#include "stripe/report/clipped_errors.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "stripe/profile/line_view.hpp"
#include "stripe/report/sigma_limit.hpp"

namespace striper::detail {
namespace {

// Errors of more than ten sigmas count as ten when the forest learns, and its tails may double
// that.
constexpr float kMostFactor = 20.0F;

float factor_of(float log_variance, float log_tail) {
  return std::clamp(sigma_factor(log_variance, log_tail), 1.0F, kMostFactor);
}

}  // namespace

float ClippedErrors::factor(const Evidence& evidence) noexcept {
  return factor_of(weigh(clipped_forest(), evidence), weigh(clipped_tail_forest(), evidence));
}

void ClippedErrors::widen(const ReturnEvidence& evidence, const ReturnEvidence::Measured& measured,
                          const ReturnConfidence& alone, Stripe& stripe) {
  const StripeChoice& choice = measured.choice;
  for (const std::size_t line : evidence.returns()) {
    const std::int32_t chosen = choice.of_line(static_cast<int>(line)).candidate;
    const bool is_clipped = choice.pieces().candidate(static_cast<std::size_t>(chosen)).is_clipped;
    if (!is_clipped || *alone.of_line(line) >= kSure) continue;
    batch_.add(evidence.of(measured, stripe, line), line);
    if (batch_.is_full()) finish_batch(choice, stripe);
  }
  finish_batch(choice, stripe);
}

void ClippedErrors::finish_batch(const StripeChoice& choice, Stripe& stripe) {
  BatchOdds log_variance{};
  BatchOdds log_tail{};
  weigh(clipped_forest(), batch_, log_variance);
  weigh(clipped_tail_forest(), batch_, log_tail);
  const double step = grid_across(stripe.grid, stripe.axis).step;
  for (std::size_t n = 0; n < batch_.count(); ++n) {
    float& sigma = stripe.sigma_px[batch_.owner(n)];
    const std::int32_t chosen = choice.of_line(static_cast<int>(batch_.owner(n))).candidate;
    const float limit = std::max(sigma, sigma_limit_px(choice, chosen, step));
    sigma = std::min(limit, sigma * factor_of(log_variance[n], log_tail[n]));
  }
  batch_.clear();
}

}  // namespace striper::detail
