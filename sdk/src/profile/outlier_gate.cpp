// SPDX-License-Identifier: Apache-2.0
#include "profile/outlier_gate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/LU>

namespace striper::detail {
namespace {

// A return that lies this many sigmas of the difference off the straight line between its two
// neighbours is looked at closely; 1.2 % of good ones are.
constexpr double kSuspectSigmas = 2.5;
// Farther than this from where a line predicts it, sigmas of the prediction: one good return in
// 16000 on each side, and both sides have to refuse it.
constexpr double kGateSigmas = 4.0;
// The same of a line through the nearest, which no one vouches for.
constexpr double kNarrowGateSigmas = 3.0;
// Noise with tails, as real sensors have, does not reach as far as this.
constexpr double kFarSigmas = 10.0;
// A line that predicts goes through three neighbours at least, where it checks itself, and through
// eight at most, as long as an edge of a curb is at 3 m.
constexpr std::size_t kFewestNeighbours = 3;
constexpr std::size_t kMostNeighbours = 8;
// Suspects that two outliers beside each other make: themselves and their neighbours.
constexpr int kMostBetween = 3;
// The neighbours are looked for among this many; more than that away they tell nothing here.
constexpr int kReach = 16;
// chi2 beyond which these neighbours are on no line themselves: one in 1000 for one degree of
// freedom, and three sigmas of chi2's own scatter for each further.
constexpr double kWorstOfOne = 10.8;
constexpr double kWorstOfMore = 2.5;
// Where this part of the returns around is suspect the surface is rough.
// Scatter of five sigmas makes 60 %; eight gross outliers among forty do too, one in 1e6 where 2 %
// are.
constexpr int kRoughReach = 20;
constexpr double kRoughPart = 0.6;
// A short line predicts badly, which must not let everything pass: the sigma of a prediction counts
// for that of eight neighbours at most, as a part of the return's own variance.
constexpr double kMostPredictionVariance = 0.61;

}  // namespace

const std::vector<char>& OutlierGate::mark(const InverseRanges& ranges) {
  const std::size_t n = ranges.size();
  suspect_.resize(n);
  suspicion_.resize(n);
  suspects_before_.assign(n + 1, 0);
  marked_.assign(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    suspicion_[i] = off_neighbours(ranges, i);
    const bool is_end = i == 0 || i + 1 == n;
    suspect_[i] = is_end || suspicion_[i] >= kSuspectSigmas * kSuspectSigmas ? 1 : 0;
    suspects_before_[i + 1] = suspects_before_[i] + suspect_[i];
  }
  mark_suspects(ranges);
  // Once more without the speckle that let other speckle pass, of two beside each other one half
  // way to the other.
  for (std::size_t i = 0; i < n; ++i) {
    if (!marked_[i]) continue;
    if (i > 0) suspect_[i - 1] = 1;
    if (i + 1 < n) suspect_[i + 1] = 1;
  }
  mark_suspects(ranges);
  return marked_;
}

// The most suspect first: it makes its neighbours suspect.
void OutlierGate::mark_suspects(const InverseRanges& ranges) {
  order_.clear();
  for (std::size_t i = 0; i < ranges.size(); ++i)
    if (suspect_[i] && !marked_[i] && !is_rough_around(i)) order_.push_back(i);
  std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
    return suspicion_[a] != suspicion_[b] ? suspicion_[a] > suspicion_[b] : a < b;
  });
  for (const std::size_t i : order_)
    marked_[i] = is_predicted(ranges, i) || is_on_curve(ranges, i) ? 0 : 1;
}

// How far an element lies off the straight line between its two neighbours, squared, over its
// variance. On a straight line q0 sin(b2 - b1) - q1 sin(b2 - b0) + q2 sin(b1 - b0) = 0.
double OutlierGate::off_neighbours(const InverseRanges& ranges, std::size_t i) noexcept {
  if (i == 0 || i + 1 >= ranges.size()) return 0.0;
  const double k0 = ranges.turn(i, i + 1);
  const double k1 = ranges.turn(i - 1, i + 1);
  const double k2 = ranges.turn(i - 1, i);
  const double e = k0 * ranges.q[i - 1] - k1 * ranges.q[i] + k2 * ranges.q[i + 1];
  const double variance =
      k0 * k0 / ranges.weight[i - 1] + k1 * k1 / ranges.weight[i] + k2 * k2 / ranges.weight[i + 1];
  return variance > 0.0 ? e * e / variance : 0.0;
}

// Not where the nearest on both sides are on one line and it is far from that. By a line on one
// side; where a side has none, by the nearest there or on both sides, whatever they are: all that a
// narrow object has.
bool OutlierGate::is_predicted(const InverseRanges& ranges, std::size_t i) const noexcept {
  const Nearest around = nearest(i, kNearest / 2, kNearest / 2);
  if (around.count == kNearest &&
      opinion_of_all(ranges, i, around, kFarSigmas) == Opinion::kRefuses)
    return false;
  const Opinion before = opinion_of_solid(ranges, i, -1);
  if (before == Opinion::kFits) return true;
  const Opinion after = opinion_of_solid(ranges, i, 1);
  if (after == Opinion::kFits) return true;
  const auto three_predict = [&](std::size_t count_before, std::size_t count_after) {
    const Nearest three = nearest(i, count_before, count_after);
    return opinion_of_all(ranges, i, three, kNarrowGateSigmas) == Opinion::kFits;
  };
  const bool is_open_before = before == Opinion::kNone;
  const bool is_open_after = after == Opinion::kNone;
  return (is_open_before && three_predict(kFewestNeighbours, 0)) ||
         (is_open_after && three_predict(0, kFewestNeighbours)) ||
         ((is_open_before || is_open_after) && (three_predict(1, 2) || three_predict(2, 1)));
}

// By the longest line through neighbours that are not suspect. What lies behind more suspect ones
// than speckle makes is another surface.
OutlierGate::Opinion OutlierGate::opinion_of_solid(const InverseRanges& ranges, std::size_t i,
                                                   int side) const noexcept {
  std::array<LineSums, kMostNeighbours + 1> solid{};  // By how many neighbours.
  std::size_t count = 0;
  int between = 0;
  const auto n = static_cast<std::ptrdiff_t>(ranges.size());
  for (int step = 1; step <= kReach && count < kMostNeighbours; ++step) {
    const std::ptrdiff_t j = static_cast<std::ptrdiff_t>(i) + side * step;
    if (j < 0 || j >= n) break;
    const auto at = static_cast<std::size_t>(j);
    if (marked_[at]) continue;
    if (suspect_[at]) {
      between += count == 0 ? 1 : 0;
      if (between > kMostBetween) return Opinion::kNone;
      continue;
    }
    solid[count + 1] = solid[count];
    ranges.add_rotated(solid[++count], at, i);
  }
  for (; count >= kFewestNeighbours; --count) {
    const Opinion of_solid = opinion_of(solid[count], ranges, i, kGateSigmas);
    if (of_solid != Opinion::kNone) return of_solid;
  }
  return Opinion::kNone;
}

// Where a surface turns away all returns are off their neighbours' lines, and on one curve.
bool OutlierGate::is_on_curve(const InverseRanges& ranges, std::size_t i) const noexcept {
  for (const std::size_t before : {kOfCurve / 2, kOfCurve, std::size_t{0}}) {
    const Nearest few = nearest(i, before, kOfCurve - before);
    const bool is_curved =
        few.count == kOfCurve && opinion_of_all(ranges, i, few, kGateSigmas) == Opinion::kNone;
    if (is_curved && opinion_of_curve(ranges, i, few) == Opinion::kFits) return true;
  }
  return false;
}

OutlierGate::Nearest OutlierGate::nearest(std::size_t i, std::size_t before,
                                          std::size_t after) const noexcept {
  Nearest few;
  const auto n = static_cast<std::ptrdiff_t>(marked_.size());
  const auto take = [&](int side, std::size_t wanted) {
    for (int step = 1; step <= kReach && wanted > 0; ++step) {
      const std::ptrdiff_t j = static_cast<std::ptrdiff_t>(i) + side * step;
      if (j < 0 || j >= n) return;
      if (marked_[static_cast<std::size_t>(j)]) continue;
      few.at[few.count++] = static_cast<std::size_t>(j);
      --wanted;
    }
  };
  take(-1, before);
  take(1, after);
  return few;
}

OutlierGate::Opinion OutlierGate::opinion_of_all(const InverseRanges& ranges, std::size_t i,
                                                 const Nearest& few, double gate_sigmas) noexcept {
  if (few.count < kFewestNeighbours) return Opinion::kNone;
  LineSums sums;
  for (std::size_t k = 0; k < few.count; ++k) ranges.add_rotated(sums, few.at[k], i);
  return opinion_of(sums, ranges, i, gate_sigmas);
}

// By a parabola through neighbours, in the direction from element i.
OutlierGate::Opinion OutlierGate::opinion_of_curve(const InverseRanges& ranges, std::size_t i,
                                                   const Nearest& few) noexcept {
  double reach = 0.0;
  for (std::size_t k = 0; k < few.count; ++k)
    reach = std::max(reach, std::abs(ranges.turn(i, few.at[k])));
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0.0;
  for (std::size_t k = 0; k < few.count; ++k) {
    const std::size_t j = few.at[k];
    const double along = ranges.turn(i, j) / reach;
    const Eigen::Vector3d terms(1.0, along, along * along);
    const double beside = ranges.q[j] - ranges.q[i];
    normal += ranges.weight[j] * terms * terms.transpose();
    right += ranges.weight[j] * beside * terms;
    squares += ranges.weight[j] * beside * beside;
  }
  const Eigen::Matrix3d covariance = normal.inverse();
  const Eigen::Vector3d fit = covariance * right;
  const double chi2 = squares - right.dot(fit);
  const auto dof = static_cast<double>(few.count) - 3.0;
  if (!(chi2 < kWorstOfOne + kWorstOfMore * (dof - 1.0))) return Opinion::kNone;
  const double own = 1.0 / ranges.weight[i];
  const double variance = own + std::min(covariance(0, 0), kMostPredictionVariance * own);
  return fit[0] * fit[0] < kGateSigmas * kGateSigmas * variance ? Opinion::kFits
                                                                : Opinion::kRefuses;
}

// What a line through neighbours, in coordinates about element i, says of this element.
OutlierGate::Opinion OutlierGate::opinion_of(const LineSums& neighbours,
                                             const InverseRanges& ranges, std::size_t i,
                                             double gate_sigmas) noexcept {
  const LineFit fit = neighbours.solve();
  if (!fit.is_determined || fit.chi2 > kWorstOfOne + kWorstOfMore * (fit.dof() - 1))
    return Opinion::kNone;
  const double e = ranges.q[i] - fit.at(1.0, 0.0);
  const double own = 1.0 / ranges.weight[i];
  const double variance = own + std::min(fit.variance_at(1.0, 0.0), kMostPredictionVariance * own);
  return e * e < gate_sigmas * gate_sigmas * variance ? Opinion::kFits : Opinion::kRefuses;
}

bool OutlierGate::is_rough_around(std::size_t i) const noexcept {
  const std::size_t n = suspect_.size();
  const std::size_t from = i > kRoughReach ? i - kRoughReach : 0;
  const std::size_t to = std::min<std::size_t>(n, i + kRoughReach + 1);
  return suspects_before_[to] - suspects_before_[from] >
         kRoughPart * static_cast<double>(to - from);
}

}  // namespace striper::detail
