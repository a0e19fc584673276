// SPDX-License-Identifier: Apache-2.0
#include "stripe/report/return_confidence.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// What is right, as judged: half a pixel, or so many sigmas.
constexpr float kRight_px = 0.5F;
constexpr float kRightSigmas = 3.0F;
constexpr int kNear = 2;  // Scan lines to either side,
constexpr int kFar = 6;
constexpr int kAbout = 4;  // and over which the choices' odds are averaged.
constexpr float kLeast = 1e-3F;
constexpr float kNotRated = -1.0F;
constexpr float kNoChoice = -9.0F;  // Log odds of a scan line that has none.

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
  const float right = std::max(kRight_px, kRightSigmas * sigma);
  return fast_log2(std::max(kLeast, off / right));
}

void add_edge(const EdgeFinding& found, float width, Evidence& e) {
  e.of[Evidence::kEdgeGain] =
      found.is_any ? fast_log2(1.0F + std::max(0.0F, found.gain)) : Evidence::kUnknown;
  e.of[Evidence::kEdgeMisfit] = found.is_any ? fast_log2(std::max(kLeast, found.misfit)) : 0.0F;
  e.of[Evidence::kEdgeContrast] = found.contrast;
  e.of[Evidence::kEdgeAway] = found.away_px / width;
}

}  // namespace

void ReturnConfidence::begin(std::size_t lines) {
  about_.assign(lines, kNoChoice);
  probability_.assign(lines, kNotRated);
}

std::optional<float> ReturnConfidence::of_line(std::size_t line) const noexcept {
  if (probability_[line] < 0.0F) return std::nullopt;
  return probability_[line];
}

void ReturnConfidence::rate(const Measured& measured, const Stripe& stripe) {
  across_ = grid_across(stripe.grid, stripe.axis);
  look_about(measured.choice);
  for (std::size_t line = 0; line < stripe.size(); ++line) {
    const bool is_any = measured.choice.of_line(static_cast<int>(line)).candidate >= 0;
    if (!is_any || !std::isfinite(stripe.across_px[line])) continue;
    batch_.add(evidence(measured, stripe, line), line);
    if (batch_.is_full()) finish_batch();
  }
  finish_batch();
}

void ReturnConfidence::finish_batch() {
  BatchOdds odds{};
  detail::weigh(fourth_forest(), batch_, odds);
  for (std::size_t n = 0; n < batch_.count(); ++n)
    probability_[batch_.owner(n)] = logistic(std::min(kMostLogOdds, odds[n]));
  batch_.clear();
}

// Those about a scan line and itself.
void ReturnConfidence::look_about(const StripeChoice& choice) {
  const int lines = choice.pieces().lines();
  const auto odds_of = [&](int line) {
    const std::int32_t candidate = choice.of_line(line).candidate;
    if (candidate < 0) return kNoChoice;
    return std::max(kNoChoice, choice.log_odds(static_cast<std::size_t>(candidate)));
  };
  float sure = 0.0F;
  for (int line = 0; line < lines; ++line) {
    const int first = std::max(0, line - kAbout);
    const int last = std::min(lines - 1, line + kAbout);
    float sum = 0.0F;
    for (int other = first; other <= last; ++other) sum += odds_of(other);
    about_[static_cast<std::size_t>(line)] = sum / static_cast<float>(last - first + 1);
    sure += logistic(odds_of(line));
  }
  coverage_ = sure / static_cast<float>(std::max(1, lines));
}

Evidence ReturnConfidence::evidence(const Measured& measured, const Stripe& stripe,
                                    std::size_t line) const noexcept {
  const StripeChoice& choice = measured.choice;
  const StripeChoice::Chosen& of_line = choice.of_line(static_cast<int>(line));
  const auto candidate = static_cast<std::size_t>(of_line.candidate);
  const Candidate& c = choice.pieces().candidate(candidate);
  const auto width = static_cast<float>(choice.width().at(static_cast<double>(c.across)));
  const float sigma = std::max(kLeast, stripe.sigma_px[line] / static_cast<float>(across_.step));
  Evidence e = choice.evidence(candidate);
  e.of[Evidence::kThird] = choice.log_odds(candidate);
  e.of[Evidence::kThirdRival] =
      of_line.rival_candidate < 0
          ? Evidence::kUnknown
          : choice.log_odds(static_cast<std::size_t>(of_line.rival_candidate));
  e.of[Evidence::kThirdNear] = about_[line];
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
  return e;
}

}  // namespace striper::detail
