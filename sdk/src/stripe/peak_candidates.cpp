// SPDX-License-Identifier: Apache-2.0
#include "stripe/peak_candidates.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace striper::detail {
namespace {

// A second candidate is measured where its pixel stands out from the noise,
constexpr double kSecondProminence = 4.0;
// and every candidate where the first one hardly does.
constexpr double kWeakFirstProminence = 6.0;

// Moves seeds to the middle of all where that is at most `most` pixels away.
bool move_to_middle(std::int32_t* across, std::size_t count, int most) {
  const auto [low, high] = std::minmax_element(across, across + count);
  if (*high - *low > 2 * most) return false;
  std::fill_n(across, count, (*low + *high) / 2);
  return true;
}

// Whether a chunk's highest pixel is its border towards a peak next to it: the peak's own flank.
bool is_flank(std::int32_t across, std::int32_t peak, int core) {
  constexpr int kChunk = ChunkMaxima::kChunk;
  const bool is_above = across > peak && across % kChunk == 0;
  const bool is_below = across < peak && across % kChunk == kChunk - 1;
  return (is_above || is_below) && std::abs(across - peak) <= core;
}

}  // namespace

void PeakCandidates::choose(const ChunkMaxima& chunks, const std::vector<std::int32_t>& brightest,
                            double noise_dn, const ProfilePlan& plan) {
  const int lines = chunks.lines();
  const auto count = static_cast<std::size_t>(lines);
  firsts.make_room(count);
  extras.make_room(count * (ChunkMaxima::kBest - 1));
  across_ = brightest;
  flat_.clear();
  extras.seeds.clear();
  const int second = std::max(1, static_cast<int>(std::ceil(kSecondProminence * noise_dn)));
  const int weak = static_cast<int>(std::ceil(kWeakFirstProminence * noise_dn));
  for (int line = 0; line < lines; ++line) {
    const int first = chunks.prominence_dn(0, line);
    const int least = first < weak ? 1 : second;
    if (first <= 0) flat_.push_back(line);
    for (int n = 1; n < ChunkMaxima::kBest && chunks.prominence_dn(n, line) >= least; ++n) {
      const std::int32_t across = chunks.best(n, line).across;
      if (is_flank(across, brightest[static_cast<std::size_t>(line)], plan.core)) continue;
      extras.seeds.push_back({line, across});
    }
  }
  align(plan.aligned);
  firsts.seeds.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    firsts.seeds[i] = {static_cast<std::int32_t>(i), across_[i]};
  }
}

void PeakCandidates::align(int most) {
  const auto move_groups = [&](std::size_t first, std::size_t last) {
    for (; first + kSeedGroup <= last; first += kSeedGroup) {
      move_to_middle(&across_[first], kSeedGroup, most);
    }
  };
  std::size_t first = 0;
  for (; first + kSeedRun <= across_.size(); first += kSeedRun) {
    if (!move_to_middle(&across_[first], kSeedRun, most)) move_groups(first, first + kSeedRun);
  }
  move_groups(first, across_.size());
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
