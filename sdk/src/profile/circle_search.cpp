// SPDX-License-Identifier: Apache-2.0
#include "profile/circle_search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include "profile/partition.hpp"

namespace striper::detail {
namespace {

// The cuts settle in one or two rounds.
constexpr int kRounds = 3;
// Beyond this many sigmas a return is not more on the other piece.
constexpr double kMostMisfit = 10.0;

double cost_of(const Run& run, double rough_penalty) noexcept {
  if (!run.is_rough) return run.fit.chi2;
  const auto m = static_cast<double>(run.to - run.from);
  return m + m * std::log(run.fit.chi2 / m) + rough_penalty;
}

double misfit2(const InverseRanges& ranges, std::size_t i, const Run& run) noexcept {
  const double sigmas = run.is_circular
                            ? misfit(ranges, i, run.circle)
                            : std::abs(ranges.q[i] - run.fit.at(ranges.cosine[i], ranges.sine[i])) *
                                  std::sqrt(ranges.weight[i]) / run.scale;
  return std::pow(std::min(sigmas, kMostMisfit), 2.0) + 2.0 * std::log(run.scale);
}

}  // namespace

// erfc(sqrt(p / 2)) = rate, by the first two terms of its tail; within 2 % from 1e-6 to .1.
double bend_penalty(double false_rate) noexcept {
  const double first = -2.0 * std::log(false_rate);
  return first - std::log(first) - std::log(0.5 * std::numbers::pi);
}

CircleFit CircleSearch::fit(const InverseRanges& ranges, std::size_t from, std::size_t to,
                            const CircleFit& start) const noexcept {
  const auto elements = std::span(elements_).subspan(from, to - from);
  const CircleFit circle = fit_circle(ranges, elements, start);
  return circle.is_determined ? circle : fit_circle(ranges, elements);
}

void CircleSearch::join(const InverseRanges& ranges, const Penalties& penalties,
                        std::vector<Run>& runs) {
  if (runs.empty()) return;
  if (elements_.size() < ranges.size()) {
    elements_.resize(ranges.size());
    std::iota(elements_.begin(), elements_.end(), std::size_t{0});
  }
  joined_.clear();
  for (std::size_t k = 0; k < runs.size();) k = join_from(k, ranges, penalties, runs);
  std::swap(runs, joined_);
  share_out(ranges, penalties, runs);
  for (int round = 0; round < kRounds; ++round) {
    bool is_moved = false;
    for (std::size_t k = 0; k + 1 < runs.size(); ++k) {
      if (!runs[k].is_circular && !runs[k + 1].is_circular) continue;
      is_moved = settle(ranges, runs[k], runs[k + 1]) || is_moved;
    }
    if (!is_moved) break;
  }
}

// Joins run `first` and those after it that gain most by being one circle; returns the run to go on
// with. A circle's chi2 only grows with more runs, so that one that costs a piece more than these
// runs do is not made longer.
std::size_t CircleSearch::join_from(std::size_t first, const InverseRanges& ranges,
                                    const Penalties& penalties, const std::vector<Run>& runs) {
  Run best = runs[first];
  std::size_t best_end = first + 1;
  double best_gain = 0.0;
  double of_runs = 0.0;
  CircleFit circle;
  for (std::size_t end = first + 1; end <= runs.size(); ++end) {
    of_runs += cost_of(runs[end - 1], penalties.rough) + (end > first + 1 ? penalties.piece : 0.0);
    const std::size_t to = runs[end - 1].to;
    if (to - runs[first].from < kFewestOfCircle) continue;
    circle = fit(ranges, runs[first].from, to, circle);
    if (!circle.is_determined || circle.chi2 > of_runs + penalties.piece) break;
    const double gain = of_runs - circle.chi2 - penalties.bend;
    if (gain <= best_gain) continue;
    best_gain = gain;
    best_end = end;
    best.to = to;
    best.circle = circle;
  }
  if (best.circle.is_determined) {
    best.is_circular = true;
    best.is_rough = false;
    best.scale = 1.0;
    best.fit = fit_run(ranges, best.from, best.to);
  }
  joined_.push_back(best);
  return best_end;
}

CircleSearch::Cut CircleSearch::best_cut(const InverseRanges& ranges, const Run& left,
                                         const Run& right, std::size_t first, std::size_t last) {
  double cost = 0.0;
  for (std::size_t i = first; i < last; ++i) cost += misfit2(ranges, i, right);
  Cut best{first, cost};
  for (std::size_t i = first; i < last; ++i) {
    cost += misfit2(ranges, i, left) - misfit2(ranges, i, right);
    if (cost < best.cost) best = {i + 1, cost};
  }
  return best;
}

void CircleSearch::cut_at(const InverseRanges& ranges, std::size_t cut, Run& left,
                          Run& right) const {
  left.to = right.from = cut;
  for (Run* run : {&left, &right}) {
    run->fit = fit_run(ranges, run->from, run->to);
    if (!run->is_circular) continue;
    run->circle = fit(ranges, run->from, run->to, run->circle);
    run->is_circular = run->circle.is_determined;
  }
}

// A straight piece that has the end of a circle and the beginning of what follows is shared out
// between both where that costs less than it does.
void CircleSearch::share_out(const InverseRanges& ranges, const Penalties& penalties,
                             std::vector<Run>& runs) {
  for (std::size_t k = 1; k + 1 < runs.size();) {
    Run& left = runs[k - 1];
    Run& right = runs[k + 1];
    const Run& middle = runs[k];
    const bool is_beside = !middle.is_circular && (left.is_circular || right.is_circular);
    const Cut cut =
        is_beside ? best_cut(ranges, left, right, middle.from, middle.to) : Cut{0, INFINITY};
    if (!(cut.cost < cost_of(middle, penalties.rough) + penalties.piece)) {
      ++k;
      continue;
    }
    cut_at(ranges, cut.at, left, right);
    runs.erase(runs.begin() + static_cast<std::ptrdiff_t>(k));
  }
}

// Cuts where the returns are on both pieces best; whether that moved the cut.
bool CircleSearch::settle(const InverseRanges& ranges, Run& left, Run& right) {
  const std::size_t first = left.from + (left.is_circular ? kFewestOfCircle : kFewestOfPiece);
  const std::size_t last = right.to - (right.is_circular ? kFewestOfCircle : kFewestOfPiece);
  if (first >= last) return false;
  const std::size_t cut = best_cut(ranges, left, right, first, last).at;
  if (cut == left.to) return false;
  cut_at(ranges, cut, left, right);
  return true;
}

}  // namespace striper::detail
