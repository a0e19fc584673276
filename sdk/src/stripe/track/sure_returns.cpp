// SPDX-License-Identifier: Apache-2.0
#include "stripe/track/sure_returns.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <span>

#include <striper/core/robust.hpp>
#include <striper/geometry/line_fit.hpp>

namespace striper::detail {
namespace {

using Iterator = std::vector<SureReturn>::const_iterator;

constexpr std::ptrdiff_t kMostNear = 12;     // On either side,
constexpr int kNearReach = 150;              // and over how many scan lines.
constexpr std::ptrdiff_t kLeastOfASide = 4;  // With fewer, a side says nothing.
constexpr std::size_t kLeastAsked = 8;       // Of both, or of one alone.
constexpr int kReachAlone = 8;               // From what was not bridged, by one side alone.
// That those beside are on a line: chi squared over its degrees of freedom (with 9, lines through
// bends of 3 px were taken for straight), and the line's error.
constexpr double kMostScatter = 3.0;
constexpr double kMostUncertain_px = 0.4;

// A board's stripe is straight over so many: where sessions (96000 to 96023) miss it a robust line
// over 10, 20, 40 and 80 to either side is within .5 px of 90, 93, 98 and all of it. In rooms,
// whose surfaces are smaller, of fewer the farther: hence the limits below.
constexpr int kFarReach = 80;
constexpr std::size_t kMostFar = 24;  // On either side, evenly spread.
constexpr std::size_t kBegunWith = 8;
constexpr int kReweighings = 6;
constexpr double kCauchy = 2.0;  // Robust sigmas at which a return counts half.
constexpr double kOnLine = 3.0;  // Robust sigmas.
// That many are: how many of them lie on it, how they scatter about it, and its error. Then of 2100
// such lines in rooms 2.5 % are .5 px off the stripe, of 5300 in sessions .2 (96000 on).
constexpr double kLeastPartOn = 0.7;
constexpr double kMostFarScatter = 4.0;
constexpr double kMostFarSigma_px = 0.25;

Iterator first_not_before(const std::vector<SureReturn>& returns, int line) {
  return std::lower_bound(returns.begin(), returns.end(), line,
                          [](const SureReturn& sure, int number) { return sure.line < number; });
}

struct Weighed {
  double away, position, sigma;
  bool is_bridged;
  double weight;
};

class FarReturns {
 public:
  void add(int line, const SureReturn& sure, double weight) {
    of_[count_++] = {static_cast<double>(sure.line - line), sure.position, sure.sigma,
                     sure.is_bridged, weight};
  }

  LineFit fit() const {
    LineSums sums;
    for (std::size_t i = 0; i < count_; ++i) {
      const Weighed& r = of_[i];
      sums.add(1.0, r.away, r.position, r.weight / (r.sigma * r.sigma));
    }
    return sums.solve();
  }

  // One robust sigma about a line, in the returns' own.
  double spread_about(const LineFit& line) const {
    std::array<double, 2 * kMostFar> off{};
    for (std::size_t i = 0; i < count_; ++i) off[i] = off_of(of_[i], line);
    const std::span<double> known{off.data(), count_};
    return std::max(1.0, robust_sigma(known));
  }

  void reweigh(const LineFit& line, double spread) {
    for (std::size_t i = 0; i < count_; ++i) {
      const double u = off_of(of_[i], line) / (kCauchy * spread);
      of_[i].weight = 1.0 / (1.0 + u * u);
    }
  }

  // What lies on a line of that spread.
  void count_on(const LineFit& line, double spread, SureLine& found) const {
    std::size_t on = 0;
    std::size_t before = 0;
    std::size_t after = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const Weighed& r = of_[i];
      if (!(off_of(r, line) < kOnLine * spread)) continue;
      ++on;
      if (!r.is_bridged) ++(r.away < 0.0 ? before : after);
    }
    found.part_on = static_cast<double>(on) / static_cast<double>(count_);
    found.bears = std::min(before, after);
  }

 private:
  static double off_of(const Weighed& r, const LineFit& line) {
    return std::abs(r.position - line.at(1.0, r.away)) / r.sigma;
  }

  std::array<Weighed, 2 * kMostFar> of_{};
  std::size_t count_ = 0;
};

}  // namespace

int SureBeside::lines_to_measured(int line) const noexcept {
  int lines = std::numeric_limits<int>::max();
  for (const std::span<const SureReturn> side : {before, after}) {
    for (const SureReturn& one : side) {
      if (!one.is_bridged) lines = std::min(lines, std::abs(one.line - line));
    }
  }
  return lines;
}

int SureBeside::lines_spanned() const noexcept {
  const SureReturn& first = before.empty() ? after.front() : before.front();
  const SureReturn& last = after.empty() ? before.back() : after.back();
  return last.line - first.line + 1;
}

bool is_trusted(const SureLine& far) noexcept {
  return far.part_on >= kLeastPartOn && far.bears >= static_cast<std::size_t>(kLeastOfASide) &&
         far.scatter < kMostFarScatter && far.sigma < kMostFarSigma_px;
}

void SureReturns::begin(std::size_t lines) {
  returns_.clear();
  returns_.reserve(lines);
}

SureBeside SureReturns::beside(int line) const {
  const Iterator middle = first_not_before(returns_, line);
  auto first = middle;
  while (first != returns_.begin() && middle - first < kMostNear &&
         (first - 1)->line >= line - kNearReach)
    --first;
  auto last = middle;
  while (last != returns_.end() && last - middle < kMostNear && last->line <= line + kNearReach)
    ++last;
  if (middle - first < kLeastOfASide) first = middle;
  if (last - middle < kLeastOfASide) last = middle;
  return {{first, middle}, {middle, last}};
}

std::optional<SureLine> SureReturns::near_line(int line, const SureBeside& beside) {
  if (beside.size() < kLeastAsked) return std::nullopt;
  LineSums sums;
  for (const std::span<const SureReturn> side : {beside.before, beside.after}) {
    for (const SureReturn& one : side) {
      sums.add(1.0, one.line - line, one.position, 1.0 / (one.sigma * one.sigma));
    }
  }
  const LineFit fitted = sums.solve();
  if (!fitted.is_determined) return std::nullopt;
  const double scatter = fitted.chi2 / fitted.dof();
  const double sigma = std::sqrt(fitted.variance_at(1.0, 0.0) * std::max(1.0, scatter));
  const std::size_t asked =
      beside.is_one_sided() ? beside.size() : std::min(beside.before.size(), beside.after.size());
  return SureLine{fitted.at(1.0, 0.0), sigma, scatter, asked};
}

std::optional<SureLine> SureReturns::far_line(int line) const {
  const Iterator first = first_not_before(returns_, line - kFarReach);
  const Iterator middle = first_not_before(returns_, line);
  const Iterator last = first_not_before(returns_, line + kFarReach + 1);
  if (middle - first < kLeastOfASide || last - middle < kLeastOfASide) return std::nullopt;
  FarReturns far;
  // From the nearest outwards, evenly spread; the search begins with the first of them alone: those
  // farther off may be more and lie elsewhere.
  const auto add = [&](std::size_t count, const auto& at) {
    const std::size_t step = (count + kMostFar - 1) / kMostFar;
    for (std::size_t k = 0; k * step < count; ++k) {
      const auto i = static_cast<std::ptrdiff_t>(k * step);
      far.add(line, *at(i), k < kBegunWith ? 1.0 : 0.0);
    }
  };
  const auto before = static_cast<std::size_t>(middle - first);
  const auto after = static_cast<std::size_t>(last - middle);
  add(before, [&](std::ptrdiff_t i) { return middle - 1 - i; });
  add(after, [&](std::ptrdiff_t i) { return middle + i; });
  LineFit fitted = far.fit();
  for (int i = 0; i < kReweighings && fitted.is_determined; ++i) {
    far.reweigh(fitted, far.spread_about(fitted));
    fitted = far.fit();
  }
  if (!fitted.is_determined) return std::nullopt;
  const double spread = far.spread_about(fitted);
  SureLine found{.position = fitted.at(1.0, 0.0),
                 .sigma = spread * std::sqrt(fitted.variance_at(1.0, 0.0)),
                 .scatter = spread * spread,
                 .asked = std::min(before, after)};
  far.count_on(fitted, spread, found);
  return found;
}

std::optional<ExpectedPlace> SureReturns::expected_at(int line, const SureBeside& beside) const {
  const bool is_one_sided = beside.is_one_sided();
  if (is_one_sided && beside.lines_to_measured(line) > kReachAlone) return std::nullopt;
  const std::optional<SureLine> near = near_line(line, beside);
  if (!near) return std::nullopt;
  const std::optional<SureLine> far = is_one_sided ? std::nullopt : far_line(line);
  const bool is_by_far = far && is_trusted(*far);
  const bool is_near_line = near->scatter <= kMostScatter && near->sigma < kMostUncertain_px;
  if (!is_by_far && !is_near_line) return std::nullopt;
  const SureLine& best = is_by_far ? *far : *near;
  ExpectedPlace expected{line, beside, best.position, best.sigma, *near, far, 0.0, 0.0};
  for (const std::span<const SureReturn> side : {beside.before, beside.after}) {
    for (const SureReturn& one : side) {
      expected.amplitude_dn += one.amplitude_dn / static_cast<double>(beside.size());
      expected.most_amplitude_dn = std::max(expected.most_amplitude_dn, one.amplitude_dn);
    }
  }
  return expected;
}

}  // namespace striper::detail
