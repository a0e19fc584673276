// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/curb_hypotheses.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

// How often what is there, and not hidden, is found (curb_finder_test.cpp: 98 to 100 of 100; wet
// and dirty streets less), and how often something is found at the same place by chance.
constexpr double kFound = 0.95;
constexpr double kByChance = 0.02;

// Curbs end at crossings.
constexpr double kCurbLength_m = 100.0;

// No evidence is so strong that it cannot be turned within 2 m of clear looks.
constexpr double kMost = 12.0;

// Kind is what was seen of late: half a metre, or the last three scans.
constexpr double kKindWay_m = 0.5;
constexpr double kLeastShare = 1.0 / 3.0;

bool is_lasting(CurbKind kind) noexcept {
  return kind != CurbKind::kNone && kind != CurbKind::kObject;
}

// A hole with ground behind is no curb, and lasts: trenches and worn joints go along the road.
double hole_in(const CurbFinding& seen) noexcept {
  const bool is_drop = seen.of(CurbKind::kDown) > 0.0 && seen.of(CurbKind::kUp) == 0.0;
  return is_drop ? seen.of(CurbKind::kNone) : 0.0;
}

}  // namespace

void CurbHypotheses::start(const CurbFinding& seen) noexcept {
  kinds_ = seen.posterior;
  hole_ = hole_in(seen);
  lasting_ = ending_ = 0.0;
  chance_ = 0.0;
}

void CurbHypotheses::hit(const CurbFinding& seen, double way_m, double object_length_m) noexcept {
  lasting_ += std::log(kFound) - way_m / kCurbLength_m;
  ending_ += std::log(kFound) - way_m / object_length_m;
  chance_ += std::log(kByChance);
  bound();
  const double by_way = 1.0 - std::exp(-way_m / kKindWay_m);
  const double share = std::max(by_way, kLeastShare);
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    kinds_[k] += share * (seen.posterior[k] - kinds_[k]);
  }
  hole_ += share * (hole_in(seen) - hole_);
}

void CurbHypotheses::miss(double way_m, double object_length_m) noexcept {
  lasting_ += std::log(1.0 - kFound * std::exp(-way_m / kCurbLength_m));
  ending_ += std::log(1.0 - kFound * std::exp(-way_m / object_length_m));
  chance_ += std::log(1.0 - kByChance);
  bound();
}

void CurbHypotheses::bound() noexcept {
  const double most = std::max({lasting_, ending_, chance_});
  for (double* const one : {&lasting_, &ending_, &chance_}) {
    *one = std::max(*one - most, -kMost);
  }
}

// What single scans say of the shape is the prior of each, never so sure that travel says nothing.
CurbHypotheses::Weights CurbHypotheses::weights() const noexcept {
  const auto of = [&](CurbKind kind) {
    return std::max(kinds_[static_cast<std::size_t>(kind)], kByChance);
  };
  const double none = std::max(of(CurbKind::kNone) - hole_, kByChance);
  const double object = of(CurbKind::kObject);
  Weights w{std::exp(lasting_) * std::max(0.0, 1.0 - none - object), std::exp(ending_) * object,
            std::exp(chance_) * none};
  const double sum = w.lasting + w.ending + w.chance;
  if (!(sum > 0.0)) return {0.0, 0.0, 1.0};
  return {w.lasting / sum, w.ending / sum, w.chance / sum};
}

double CurbHypotheses::probability_of(CurbKind kind) const noexcept {
  const Weights w = weights();
  if (kind == CurbKind::kObject) return w.ending;
  double lasting = hole_;
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    if (is_lasting(static_cast<CurbKind>(k))) lasting += kinds_[k];
  }
  const double all = std::max(lasting, 1e-12);
  if (kind == CurbKind::kNone) return w.chance + w.lasting * hole_ / all;
  return w.lasting * kinds_[static_cast<std::size_t>(kind)] / all;
}

double CurbHypotheses::probability_of_curb() const noexcept {
  return probability_of(CurbKind::kUp) + probability_of(CurbKind::kDown);
}

double CurbHypotheses::probability_of_something() const noexcept { return 1.0 - weights().chance; }

CurbKind CurbHypotheses::kind() const noexcept {
  auto best = CurbKind::kNone;
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    const auto kind = static_cast<CurbKind>(k);
    if (probability_of(kind) > probability_of(best)) best = kind;
  }
  return best;
}

}  // namespace striper::detail
