// SPDX-License-Identifier: Apache-2.0
#include "stripe/report/error_budget.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "stripe/profile/line_view.hpp"
#include "stripe/report/sigma_limit.hpp"

namespace striper::detail {
namespace {

void add_everywhere(double sigma_px, Stripe& stripe) {
  if (!(sigma_px > 0.0)) return;
  const auto added = static_cast<float>(sigma_px * sigma_px);
  for (float& sigma : stripe.sigma_px) sigma = std::sqrt(sigma * sigma + added);
}

// What lies near the line of those beside it is chosen: its errors are smaller than its noise, by
// a tenth and more of the weakest stripes.
constexpr float kLeastOfNoise = 0.9F;

void scale_by_evidence(const StripeChoice& choice, double step, Stripe& stripe) {
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const StripeChoice::Chosen& chosen = choice.of_line(stripe.line[i]);
    if (chosen.candidate < 0 || std::isnan(stripe.sigma_px[i])) continue;
    const float noise = choice.pieces().candidate(static_cast<std::size_t>(chosen.candidate)).sigma;
    stripe.sigma_px[i] = std::max(kLeastOfNoise * static_cast<float>(step) * noise,
                                  stripe.sigma_px[i] * chosen.sigma_factor);
  }
}

// Even where the noise alone says more. @param given_px the error that every return has, if it is
// given: it counts beside the limit.
void limit_by_width(const StripeChoice& choice, double step, float given_px, Stripe& stripe) {
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const std::int32_t candidate = choice.of_line(stripe.line[i]).candidate;
    if (candidate < 0 || std::isnan(stripe.sigma_px[i])) continue;
    const float limit = std::hypot(given_px, sigma_limit_px(choice, candidate, step));
    stripe.sigma_px[i] = std::min(stripe.sigma_px[i], limit);
  }
}

}  // namespace

void ErrorBudget::add(const FrameAtHand& at_hand, const Width& width, const StripeChoice& choice,
                      const ExtractOptions& options, Stripe& stripe) {
  const bool is_given = options.excess_sigma_px.has_value();
  if (!is_given) excess_of(at_hand.frame.laser).update(stripe);
  edges_.correct(at_hand.frame, at_hand.noise, width.model, stripe);
  add_everywhere(excess_sigma_px(at_hand, options), stripe);
  const AxisGrid& across = grid_across(at_hand.frame.grid, options.axis);
  if (!is_given) texture_.add(width.model, width.is_known, across, stripe);
  const bool is_one_a_line = options.peak != PeakRule::kAll;
  if (choice.is_plain() || !is_one_a_line) return;
  scale_by_evidence(choice, at_hand.step, stripe);
  const auto given_px = static_cast<float>(options.excess_sigma_px.value_or(0.0) * at_hand.step);
  limit_by_width(choice, at_hand.step, given_px, stripe);
}

double ErrorBudget::excess_sigma_px(const FrameAtHand& at_hand, const ExtractOptions& options) {
  if (options.excess_sigma_px) return *options.excess_sigma_px * at_hand.step;
  return excess_of(at_hand.frame.laser).sigma_px();
}

ExcessScatter& ErrorBudget::excess_of(int laser) {
  const auto index = static_cast<std::size_t>(std::max(0, laser));
  if (index >= excess_.size()) excess_.resize(index + 1);
  return excess_[index];
}

}  // namespace striper::detail
