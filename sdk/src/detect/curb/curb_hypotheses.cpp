// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/curb_hypotheses.hpp"

#include <algorithm>
#include <cmath>

#include "detect/curb/curb_posterior.hpp"

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

// How often the tips of grass look like paving in one scan, and paving or stones with grass behind
// them like grass (curb_detector_test.cpp); how far apart such looks are independent, and how far a
// verge is the same.
constexpr double kLevelGrass = 0.1;
constexpr double kGrassBehind = 0.05;
constexpr double kAlike_m = 0.1;
constexpr double kVergeLength_m = 20.0;

// Log odds of what began a track: further scans have to be able to turn it.
constexpr double kSurest = 5.0;

std::size_t index(CurbKind kind) noexcept { return static_cast<std::size_t>(kind); }

bool is_lasting(CurbKind kind) noexcept {
  return kind != CurbKind::kNone && kind != CurbKind::kObject;
}

// A hole with ground behind is no curb, and lasts: trenches and worn joints go along the road.
double hole_in(const CurbFinding& seen) noexcept {
  const bool is_drop = seen.of(CurbKind::kDown) > 0.0 && seen.of(CurbKind::kUp) == 0.0;
  return is_drop ? seen.of(CurbKind::kNone) : 0.0;
}

}  // namespace

void CurbHypotheses::start(const CurbFinding& seen, double overgrown) noexcept {
  kinds_.fill(0.0);
  hole_ = 0.0;
  overgrown_ = overgrown;
  take_kinds(seen, 1.0);
  // Alone, a scan is believed as CurbFinding's posterior is, but not so that no other turns it.
  overgrown_ = after(overgrown_, std::clamp(seen.overgrown_log_odds, -kSurest, kSurest));
  lasting_ = ending_ = 0.0;
  chance_ = 0.0;
}

void CurbHypotheses::hit(const CurbFinding& seen, double way_m, double object_length_m) noexcept {
  lasting_ += std::log(kFound) - way_m / kCurbLength_m;
  ending_ += std::log(kFound) - way_m / object_length_m;
  chance_ += std::log(kByChance);
  bound();
  take_kinds(seen, std::max(1.0 - std::exp(-way_m / kKindWay_m), kLeastShare));
  const double changed = 1.0 - std::exp(-way_m / kVergeLength_m);
  overgrown_ += changed * (kOvergrown - overgrown_);
  take_growth(seen, 1.0 - std::exp(-way_m / kAlike_m));
}

void CurbHypotheses::see_beside(const CurbFinding& other, double way_m) noexcept {
  if (other.overgrown_log_odds > 0.0) take_growth(other, 1.0 - std::exp(-way_m / kAlike_m));
}

// Where a scan is sure that it is overgrown it says nothing of what else it were.
void CurbHypotheses::take_kinds(const CurbFinding& seen, double share) noexcept {
  constexpr double kLeast = 1e-9;
  const double none = seen.of(CurbKind::kNone);
  const double other = 1.0 - none - seen.of(CurbKind::kRough);
  if (other < kLeast) return;
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    const double now =
        k == index(CurbKind::kNone) ? none : seen.posterior[k] / other * (1.0 - none);
    if (k != index(CurbKind::kRough)) kinds_[k] += share * (now - kinds_[k]);
  }
  hole_ += share * (hole_in(seen) - hole_);
}

// By Bayes, of a scan that is wrong at times; not the same blades twice.
void CurbHypotheses::take_growth(const CurbFinding& seen, double share) noexcept {
  const double ratio = std::exp(std::clamp(seen.overgrown_log_odds, -30.0, 30.0));
  const double told =
      ((1.0 - kLevelGrass) * ratio + kLevelGrass) / (kGrassBehind * ratio + 1.0 - kGrassBehind);
  overgrown_ = after(overgrown_, share * std::log(told));
}

// Of what single scans say, by kind.
double CurbHypotheses::part_of(CurbKind kind) const noexcept {
  const double none = kinds_[index(CurbKind::kNone)];
  if (kind == CurbKind::kNone) return none;
  if (kind == CurbKind::kRough) return overgrown_ * (1.0 - none);
  return (1.0 - overgrown_) * kinds_[index(kind)];
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
  const auto of = [&](CurbKind kind) { return std::max(part_of(kind), kByChance); };
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
    const auto one = static_cast<CurbKind>(k);
    if (is_lasting(one)) lasting += part_of(one);
  }
  const double all = std::max(lasting, 1e-12);
  if (kind == CurbKind::kNone) return w.chance + w.lasting * hole_ / all;
  return w.lasting * part_of(kind) / all;
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
