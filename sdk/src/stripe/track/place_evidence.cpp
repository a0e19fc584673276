// SPDX-License-Identifier: Apache-2.0
#include "stripe/track/place_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>

#include "stripe/select/forests/choice_trees.hpp"
#include "stripe/track/evidence_scale.hpp"

namespace striper::detail {
namespace {

// How it lies to either line.
void add_lines(const ExpectedPlace& expected, double position, BridgeEvidence& e) {
  e.of[BridgeEvidence::kOffNear] = at_most(kFarthest, std::abs(position - expected.near.position));
  e.of[BridgeEvidence::kOffFar] = static_cast<float>(kFarthest);
  if (!expected.far) return;
  const SureLine& far = *expected.far;
  e.of[BridgeEvidence::kHasFar] = 1.0F;
  e.of[BridgeEvidence::kIsByFar] = is_trusted(far) ? 1.0F : 0.0F;
  e.of[BridgeEvidence::kOffFar] = at_most(kFarthest, std::abs(position - far.position));
  e.of[BridgeEvidence::kFarSigma] = log2_of(far.sigma);
  e.of[BridgeEvidence::kFarScatter] = log2_of(far.scatter);
  e.of[BridgeEvidence::kFarPart] = static_cast<float>(far.part_on);
  e.of[BridgeEvidence::kFarAsked] = log2_of(static_cast<double>(far.asked));
}

// How sure the returns beside are.
void add_sure(const SureBeside& sure, BridgeEvidence& e) {
  float sum = 0.0F;
  float least = kMostLogOdds;
  float bridged = 0.0F;
  for (const std::span<const SureReturn> side : {sure.before, sure.after}) {
    for (const SureReturn& one : side) {
      sum += one.log_odds;
      least = std::min(least, one.log_odds);
      if (one.is_bridged) bridged += 1.0F;
    }
  }
  const auto count = static_cast<float>(sure.size());
  e.of[BridgeEvidence::kSureOdds] = sum / count;
  e.of[BridgeEvidence::kLeastSureOdds] = least;
  e.of[BridgeEvidence::kBridgedPart] = bridged / count;
}

}  // namespace

void add_place(const ExpectedPlace& expected, const MeasuredPlace& measured, BridgeEvidence& e) {
  const SureBeside& sure = expected.by;
  const SureReturn& before = sure.nearest_before();
  const SureReturn& after = sure.nearest_after();
  const int to_before = std::abs(expected.line - before.line);
  const int to_after = std::abs(expected.line - after.line);
  const double off = std::abs(measured.position - expected.position);
  const double lower_dn = std::min(before.amplitude_dn, after.amplitude_dn);
  e.of[BridgeEvidence::kOff] = at_most(kFarthest, off / std::hypot(measured.sigma, expected.sigma));
  e.of[BridgeEvidence::kOffPixels] = static_cast<float>(off);
  e.of[BridgeEvidence::kFreeOff] = at_most(kFarthest, measured.free_off_px);
  e.of[BridgeEvidence::kLineSigma] = log2_of(expected.sigma);
  e.of[BridgeEvidence::kNearer] = log2_of(std::min(to_before, to_after));
  e.of[BridgeEvidence::kFarther] = log2_of(std::max(to_before, to_after));
  e.of[BridgeEvidence::kSpan] = log2_of(sure.lines_spanned());
  e.of[BridgeEvidence::kScatter] = log2_of(expected.near.scatter);
  e.of[BridgeEvidence::kHeight] = log2_ratio(measured.height_dn, lower_dn);
  e.of[BridgeEvidence::kHeightStep] = std::abs(log2_ratio(before.amplitude_dn, after.amplitude_dn));
  e.of[BridgeEvidence::kHeightMost] = log2_ratio(expected.most_amplitude_dn, expected.amplitude_dn);
  e.of[BridgeEvidence::kAsked] = static_cast<float>(expected.near.asked);
  add_lines(expected, measured.position, e);
  add_sure(sure, e);
  if (sure.is_one_sided()) {
    e.of[BridgeEvidence::kIsOneSided] = 1.0F;
    return;
  }
  const double kink = std::abs((expected.position - before.position) / to_before -
                               (after.position - expected.position) / to_after);
  e.of[BridgeEvidence::kKink] = at_most(kFarthest, kink * std::min(to_before, to_after));
}

}  // namespace striper::detail
