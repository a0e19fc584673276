// SPDX-License-Identifier: Apache-2.0
#include "stripe/report/rated_neighbours.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/profile/line_view.hpp"
#include "stripe/report/what_is_right.hpp"
#include "stripe/select/forests/choice_trees.hpp"
#include "stripe/select/piece_traits.hpp"

namespace striper::detail {
namespace {

// Scan lines to either side: the few beside a return, those of a line through it, of a surface.
constexpr int kBeside = 2;
constexpr int kNear = 6;
constexpr int kFar = 16;
constexpr int kMostAway = 200;
// What is less probable makes no line; what is more probable counts by its eighth power.
constexpr float kInLine = 0.9F;
// That a line is level counts as much as so many returns a scan line away that say so. On steep
// lines a little of the slope is left, and counts as scatter.
constexpr double kFlat = 5.0;
// So many make a line, of both sides and of one.
constexpr double kLeastOfBoth = 1.5;
constexpr double kLeastOfOne = 3.0;
constexpr float kLeastOff = 1e-3F;
constexpr float kLeastScatter_px = 1e-2F;
constexpr float kAnyScatter_px = 0.1F;

float weight_of(float probability) {
  if (!(probability > kInLine)) return 0.0F;
  const float squared = probability * probability;
  return squared * squared * squared * squared;
}

}  // namespace

void RatedNeighbours::begin(std::size_t lines) {
  odds_.assign(lines, kNoReturn);
  rated_.assign(lines, Rated{});
  coverage_ = mean_ = 0.0F;
}

void RatedNeighbours::hear(const Stripe& stripe, std::span<const float> odds) {
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  const auto step = static_cast<float>(across.step);
  begin(odds.size());
  std::copy(odds.begin(), odds.end(), odds_.begin());
  for (std::size_t line = 0; line < odds.size(); ++line) {
    if (!(odds[line] > kNoReturn)) continue;
    const float probability = logistic(odds[line]);
    Rated& rated = rated_[line];
    rated.weight = weight_of(probability);
    rated.position = static_cast<float>(across.index(stripe.across_px[line]));
    rated.right = right_within_px(stripe.sigma_px[line] / step);
    mean_ += probability / static_cast<float>(odds.size());
  }
  find_sure();
}

void RatedNeighbours::find_sure() {
  const std::size_t lines = rated_.size();
  const auto is_sure = [this](std::size_t line) { return logistic(odds_[line]) >= kSure; };
  std::size_t sure = 0;
  int away = kMostAway;
  for (std::size_t line = 0; line < lines; ++line) {
    rated_[line].before = std::min(kMostAway, ++away);
    if (!is_sure(line)) continue;
    away = 0;
    ++sure;
  }
  away = kMostAway;
  for (std::size_t line = lines; line-- > 0;) {
    rated_[line].after = std::min(kMostAway, ++away);
    if (is_sure(line)) away = 0;
  }
  coverage_ = static_cast<float>(sure) / static_cast<float>(std::max<std::size_t>(1, lines));
}

LineSums RatedNeighbours::sums(std::size_t line, int from, int to) const noexcept {
  LineSums sums;
  const auto own = static_cast<int>(line);
  const double position = static_cast<double>(rated_[line].position);
  const int first = std::max(0, own + from);
  const int last = std::min(static_cast<int>(rated_.size()) - 1, own + to);
  for (int other = first; other <= last; ++other) {
    const Rated& rated = rated_[static_cast<std::size_t>(other)];
    if (other == own || !(rated.weight > 0.0F)) continue;
    sums.add(1.0, other - own, static_cast<double>(rated.position) - position,
             static_cast<double>(rated.weight));
  }
  return sums;
}

RatedNeighbours::Off RatedNeighbours::off(std::size_t line, const LineSums& others,
                                          double least_weight) const noexcept {
  if (!(others.ff > least_weight)) return {};
  LineSums sums = others;
  sums.add(0.0, 1.0, 0.0, kFlat);
  const LineFit fit = sums.solve();
  const auto off = static_cast<float>(std::abs(fit.at(1.0, 0.0)));
  const auto scatter = static_cast<float>(std::sqrt(fit.chi2 / others.ff));
  return {fast_log2(std::max(kLeastOff, off / rated_[line].right)),
          fast_log2(std::max(kLeastOff, off / (scatter + kAnyScatter_px))),
          fast_log2(std::max(kLeastScatter_px, scatter))};
}

void RatedNeighbours::add_line(Evidence& e, Evidence::Kind first_kind, std::size_t line,
                               int reach) const noexcept {
  const LineSums others = sums(line, -reach, reach);
  const Off found = off(line, others, kLeastOfBoth);
  e.of[first_kind] = static_cast<float>(others.ff);
  e.of[first_kind + 1] = found.by_right;
  e.of[first_kind + 2] = found.by_scatter;
  e.of[first_kind + 3] = found.scatter;
}

void RatedNeighbours::add_to(Evidence& e, std::size_t line) const noexcept {
  e.of[Evidence::kFourth] = odds_[line];
  e.of[Evidence::kFourthBeside] = mean_odds_about(odds_, line, kBeside);
  e.of[Evidence::kFourthNear] = mean_odds_about(odds_, line, kNear);
  e.of[Evidence::kFourthFar] = mean_odds_about(odds_, line, kFar);
  e.of[Evidence::kFourthBefore] = fast_log2(static_cast<float>(rated_[line].before));
  e.of[Evidence::kFourthAfter] = fast_log2(static_cast<float>(rated_[line].after));
  e.of[Evidence::kFourthCoverage] = coverage_;
  e.of[Evidence::kFourthMean] = mean_;
  add_line(e, Evidence::kFourthLineNear, line, kNear);
  add_line(e, Evidence::kFourthLineFar, line, kFar);
  const float before = off(line, sums(line, -kFar, -1), kLeastOfOne).by_right;
  const float after = off(line, sums(line, 1, kFar), kLeastOfOne).by_right;
  const bool has_both = before > Evidence::kUnknown && after > Evidence::kUnknown;
  e.of[Evidence::kFourthOffOneSide] = has_both ? std::min(before, after) : std::max(before, after);
  e.of[Evidence::kFourthOffOther] = has_both ? std::max(before, after) : Evidence::kUnknown;
}

}  // namespace striper::detail
