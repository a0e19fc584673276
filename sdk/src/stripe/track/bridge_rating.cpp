// SPDX-License-Identifier: Apache-2.0
#include "stripe/track/bridge_rating.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "stripe/select/forests/choice_trees.hpp"

namespace striper::detail {
namespace {

// Written by tests/bench/fit_bridges.py, net by net; weights: of each input, those of all outputs.
#include "stripe/track/bridge_rating.inc"

constexpr std::size_t kNets = std::size(kLastBiases);
constexpr std::size_t kInputs = BridgeEvidence::kCount;
constexpr std::size_t kHidden = std::size(kFirstBiases) / kNets;
static_assert(std::size(kFirstWeights) == kNets * kInputs * kHidden);
static_assert(std::size(kSecondWeights) == kNets * kHidden * kHidden);
static_assert(std::size(kSecondBiases) == kNets * kHidden);
static_assert(std::size(kLastWeights) == kNets * kHidden);

using Hidden = std::array<float, kHidden>;

// What is negative is cut off.
template <std::size_t kCount>
Hidden weighed(const std::array<float, kCount>& inputs, const float* weights, const float* biases) {
  Hidden sums;
  std::copy_n(biases, kHidden, sums.begin());
  for (const float input : inputs) {
    for (float& sum : sums) sum += input * *weights++;
  }
  for (float& sum : sums) sum = std::max(0.0F, sum);
  return sums;
}

float log_odds_by(std::size_t net, const BridgeEvidence& evidence) {
  const std::size_t at = net * kHidden;
  const Hidden first = weighed(evidence.of, kFirstWeights + at * kInputs, kFirstBiases + at);
  const Hidden second = weighed(first, kSecondWeights + at * kHidden, kSecondBiases + at);
  float log_odds = kLastBiases[net];
  for (std::size_t i = 0; i < kHidden; ++i) log_odds += second[i] * kLastWeights[at + i];
  return log_odds;
}

}  // namespace

float bridge_probability(const BridgeEvidence& evidence) noexcept {
  const auto is_finite = [](float value) { return std::isfinite(value); };
  if (!std::all_of(evidence.of.begin(), evidence.of.end(), is_finite)) return 0.0F;
  float sum = 0.0F;
  for (std::size_t net = 0; net < kNets; ++net) sum += log_odds_by(net, evidence);
  const float log_odds = std::clamp(sum / kNets, -kMostLogOdds, kMostLogOdds);
  return 1.0F / (1.0F + std::exp(-log_odds));
}

}  // namespace striper::detail
