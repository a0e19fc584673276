// SPDX-License-Identifier: Apache-2.0
#include "stripe/report/return_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/profile/line_view.hpp"
#include "stripe/report/line_odds.hpp"
#include "stripe/report/what_is_right.hpp"
#include "stripe/select/piece_traits.hpp"

namespace striper::detail {
namespace {

constexpr std::size_t kNear = 2;  // Scan lines to either side,
constexpr std::size_t kFar = 6;
constexpr std::size_t kAbout = 4;  // and over which the choices' odds are averaged.
constexpr float kLeast = 1e-3F;

// Log of what a return lies off the middle of those so many scan lines before and after it, over
// what is right.
float off_those_beside(const Stripe& stripe, const AxisGrid& across, std::size_t line,
                       std::size_t away) {
  if (line < away || line + away >= stripe.size()) return Evidence::kUnknown;
  const auto& at = stripe.across_px;
  const double middle = 0.5 * (at[line - away] + at[line + away]);
  if (!std::isfinite(middle)) return Evidence::kUnknown;
  const auto off = static_cast<float>(std::abs(at[line] - middle) / across.step);
  const float sigma = stripe.sigma_px[line] / static_cast<float>(across.step);
  return fast_log2(std::max(kLeast, off / right_within_px(sigma)));
}

std::size_t chosen_in(const StripeChoice& choice, std::size_t line) {
  return static_cast<std::size_t>(choice.of_line(static_cast<int>(line)).candidate);
}

void add_edge(const EdgeFinding& found, float width, Evidence& e) {
  e.of[Evidence::kEdgeGain] =
      found.is_any ? fast_log2(1.0F + std::max(0.0F, found.gain)) : Evidence::kUnknown;
  e.of[Evidence::kEdgeMisfit] = found.is_any ? fast_log2(std::max(kLeast, found.misfit)) : 0.0F;
  e.of[Evidence::kEdgeContrast] = found.contrast;
  e.of[Evidence::kEdgeAway] = found.away_px / width;
}

}  // namespace

void ReturnEvidence::begin(std::size_t lines) {
  returns_.clear();
  returns_.reserve(lines);
  chosen_.assign(lines, kNoReturn);
  coverage_ = 0.0F;
}

void ReturnEvidence::look_at(const Measured& measured, const Stripe& stripe) {
  begin(stripe.size());
  across_ = grid_across(stripe.grid, stripe.axis);
  look_about(measured.choice);
  for (std::size_t line = 0; line < stripe.size(); ++line) {
    const bool is_any = measured.choice.of_line(static_cast<int>(line)).candidate >= 0;
    if (is_any && std::isfinite(stripe.across_px[line])) returns_.push_back(line);
  }
}

Evidence ReturnEvidence::of(const Measured& measured, const Stripe& stripe,
                            std::size_t line) const noexcept {
  Evidence e = measured.choice.evidence(chosen_in(measured.choice, line));
  add_measured(measured, stripe, line, e);
  return e;
}

void ReturnEvidence::look_about(const StripeChoice& choice) {
  float sure = 0.0F;
  for (std::size_t line = 0; line < chosen_.size(); ++line) {
    if (choice.of_line(static_cast<int>(line)).candidate >= 0)
      chosen_[line] = std::max(kNoReturn, choice.log_odds(chosen_in(choice, line)));
    sure += logistic(chosen_[line]);
  }
  coverage_ = sure / static_cast<float>(std::max<std::size_t>(1, chosen_.size()));
}

void ReturnEvidence::add_measured(const Measured& measured, const Stripe& stripe, std::size_t line,
                                  Evidence& e) const noexcept {
  const StripeChoice& choice = measured.choice;
  const StripeChoice::Chosen& of_line = choice.of_line(static_cast<int>(line));
  const std::size_t candidate = chosen_in(choice, line);
  const Candidate& c = choice.pieces().candidate(candidate);
  const auto width = static_cast<float>(choice.width().at(static_cast<double>(c.across)));
  const float sigma = std::max(kLeast, stripe.sigma_px[line] / static_cast<float>(across_.step));
  e.of[Evidence::kThird] = choice.log_odds(candidate);
  e.of[Evidence::kThirdRival] =
      of_line.rival_candidate < 0
          ? Evidence::kUnknown
          : choice.log_odds(static_cast<std::size_t>(of_line.rival_candidate));
  e.of[Evidence::kThirdNear] = mean_odds_about(chosen_, line, kAbout);
  e.of[Evidence::kThirdCoverage] = coverage_;
  e.of[Evidence::kReturnWidth] = fast_log2(width);
  e.of[Evidence::kReturnSigma] = fast_log2(sigma);
  e.of[Evidence::kReturnWidened] = fast_log2(sigma / std::max(kLeast, c.sigma));
  e.of[Evidence::kReturnMoved] =
      static_cast<float>(across_.index(stripe.across_px[line]) - static_cast<double>(c.across)) /
      width;
  e.of[Evidence::kReturnOffNear] = off_those_beside(stripe, across_, line, kNear);
  e.of[Evidence::kReturnOffFar] = off_those_beside(stripe, across_, line, kFar);
  add_edge(measured.edges.finding(line), width, e);
}

}  // namespace striper::detail
