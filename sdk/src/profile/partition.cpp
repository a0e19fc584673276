// SPDX-License-Identifier: Apache-2.0
#include "profile/partition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace striper::detail {
namespace {

// Beginnings that one evaluation bounds. A line that is cut once and loses this many points gains
// about as many of chi2, which has to stay well below the penalty of 25 or so.
constexpr std::size_t kBlock = 8;

// Shorter pieces lose digits in differences of sums over everything.
constexpr std::size_t kLong = kFewestOfRough;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

const std::vector<std::size_t>& Partition::cut(const InverseRanges& ranges,
                                               const Penalties& penalties) {
  penalties_ = penalties;
  cuts_.clear();
  if (ranges.size() < kFewestOfPiece) return cuts_;
  prepare(ranges);
  for (std::size_t to = kFewestOfPiece; to <= ranges.size(); ++to) end_at(ranges, to);
  trace_back();
  return cuts_;
}

// Less the line through all, so that the sums are of numbers near zero and keep their digits.
void Partition::prepare(const InverseRanges& ranges) {
  const std::size_t n = ranges.size();
  LineSums all;
  for (std::size_t i = 0; i < n; ++i) ranges.add_to(all, i);
  const LineFit line = all.solve();
  before_.resize(n + 1);
  before_[0] = {};
  for (std::size_t i = 0; i < n; ++i) {
    before_[i + 1] = before_[i];
    const double z = ranges.q[i] - line.at(ranges.cosine[i], ranges.sine[i]);
    before_[i + 1].add(ranges.cosine[i], ranges.sine[i], z, ranges.weight[i]);
  }
  best_.assign(n + 1, kInfinity);
  begin_.assign(n + 1, 0);
  lower_.assign(n + 1, kInfinity);
  best_[0] = lower_[0] = 0.0;
  blocks_.clear();
  blocks_.reserve(n / kBlock + 1);
}

LineSums Partition::between(std::size_t from, std::size_t to) const noexcept {
  LineSums sums = before_[to];
  sums -= before_[from];
  return sums;
}

double Partition::cost(double chi2, std::size_t points) const noexcept {
  const auto m = static_cast<double>(points);
  const double beyond = chi2 - m;
  // chi2 - m - m ln(chi2 / m) < (chi2 - m)^2 / (2 m): most pieces need no logarithm.
  if (points < kFewestOfRough || beyond <= 0.0 || beyond * beyond <= 2.0 * m * penalties_.rough)
    return chi2;
  return std::min(chi2, m + m * std::log(chi2 / m) + penalties_.rough);
}

double Partition::long_cost(std::size_t from, std::size_t to) const noexcept {
  return cost(between(from, to).chi2(), to - from);
}

void Partition::end_at(const InverseRanges& ranges, std::size_t to) {
  found_ = kInfinity;
  found_begin_ = 0;
  const std::size_t near = blocks_.size() * kBlock;
  const std::size_t last = begin_[to - 1];  // The best beginning seldom moves.
  if (last + kLong <= to && std::isfinite(best_[last])) {
    found_ = best_[last] + long_cost(last, to);
    found_begin_ = last;
  }
  try_near(ranges, near, to);
  try_blocks(to);
  best_[to] = lower_[to] = found_ + penalties_.piece;
  begin_[to] = found_begin_;
  close_block(to);
}

// Beginnings that are in no block yet: of short pieces from the end backwards, in coordinates about
// the end, where they lose no digits.
void Partition::try_near(const InverseRanges& ranges, std::size_t from, std::size_t to) noexcept {
  const std::size_t first_short = std::max(from, to > kLong ? to - kLong : 0);
  for (std::size_t begin = from; begin < first_short; ++begin) try_begin(begin, to);
  std::size_t first = first_short;
  while (first + kFewestOfPiece <= to && !(lower_[first] < found_)) ++first;
  if (first + kFewestOfPiece > to) return;
  LineSums sums;
  for (std::size_t begin = to; begin-- > first;) {
    ranges.add_rotated(sums, begin, to - 1);
    if (to - begin < kFewestOfPiece || !(lower_[begin] < found_)) continue;
    const double chi2 = sums.chi2();
    take(begin, best_[begin] + cost(chi2, to - begin));
    // With more points the piece may be a rough one, and cost less.
    lower_[begin] = best_[begin] + cost(chi2, std::max(to - begin, kFewestOfRough));
  }
}

void Partition::try_begin(std::size_t begin, std::size_t to) noexcept {
  if (lower_[begin] < found_) take(begin, best_[begin] + long_cost(begin, to));
}

void Partition::take(std::size_t begin, double total) noexcept {
  lower_[begin] = total;
  if (total >= found_) return;
  found_ = total;
  found_begin_ = begin;
}

void Partition::try_blocks(std::size_t to) noexcept {
  for (Block& block : blocks_) {
    if (block.lower >= found_) continue;
    block.lower = block.least + long_cost(block.from + kBlock - 1, to);
    if (block.lower >= found_) continue;
    for (std::size_t begin = block.from; begin < block.from + kBlock; ++begin) try_begin(begin, to);
  }
}

// A block is closed when all pieces from it on have enough points for the long way.
void Partition::close_block(std::size_t to) {
  const std::size_t from = blocks_.size() * kBlock;
  if (to + 1 < from + kBlock + kLong) return;
  const auto begin = best_.begin() + static_cast<std::ptrdiff_t>(from);
  const double least = *std::min_element(begin, begin + kBlock);
  blocks_.push_back({from, least, least});
}

void Partition::trace_back() {
  for (std::size_t to = best_.size() - 1; to > 0; to = begin_[to]) cuts_.push_back(begin_[to]);
  std::reverse(cuts_.begin(), cuts_.end());
}

}  // namespace striper::detail
