// SPDX-License-Identifier: Apache-2.0
#include "stripe/peak_candidates.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

// A second candidate is measured where its pixel stands out from the noise,
constexpr double kSecondProminence = 4.0;
// and every candidate where the first one hardly does.
constexpr double kWeakFirstProminence = 6.0;

}  // namespace

void PeakCandidates::choose(const ChunkMaxima& chunks, const std::vector<std::int32_t>& brightest,
                            double noise_dn, const ProfilePlan& plan) {
  const auto count = static_cast<std::size_t>(chunks.lines());
  firsts.make_room(count);
  extras.make_room(count * (ChunkMaxima::kBest - 1));
  ChunkMaxima::RivalLimits limits;
  limits.second_dn = std::max(1, static_cast<int>(std::ceil(kSecondProminence * noise_dn)));
  limits.weak_dn = static_cast<int>(std::ceil(kWeakFirstProminence * noise_dn));
  limits.flank_px = plan.core;
  chunks.find_rivals(limits, extras.seeds, flat_);
  firsts.seeds.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    firsts.seeds[i] = {static_cast<std::int32_t>(i), brightest[i]};
  }
}

void PeakCandidates::blank_flat_lines() {
  for (const std::int32_t line : flat_) firsts.significance[static_cast<std::size_t>(line)] = 0.0F;
}

std::size_t PeakCandidates::first_extra(int line) const {
  const auto before = [](const PeakSeed& seed, int l) { return seed.line < l; };
  const auto at = std::lower_bound(extras.seeds.begin(), extras.seeds.end(), line, before);
  return static_cast<std::size_t>(at - extras.seeds.begin());
}

}  // namespace striper::detail
