// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/choice_weights.hpp"

#include <numeric>

namespace striper::detail {
namespace {

std::array<float, Evidence::kCount> kWeights{
    /* kOne          */ -2.0F,
    /* kLength       */ 4.0F,
    /* kIsShort      */ -1.0F,
    /* kSupport      */ 8.0F,
    /* kRoughness    */ -3.0F,
    /* kBends        */ -3.0F,
    /* kWide         */ -10.0F,
    /* kNarrow       */ -10.0F,
    /* kWidthSpread  */ -4.0F,
    /* kFaint        */ -3.0F,
    /* kBright       */ -1.0F,
    /* kHeightChange */ -1.0F,
    /* kTilt         */ -6.0F,
    /* kSnr          */ 2.0F,
    /* kClipped      */ 0.0F,
    /* kCoverage     */ 4.0F,
    /* kClutter      */ -1.0F,
    /* kSubtracted   */ 3.0F,
    /* kHidden       */ 0.0F,
    /* kHiddenSupport*/ 0.0F,
    /* kClutterSupp  */ 0.0F,
    /* kWideKnown    */ 0.0F,
    /* kNarrowKnown  */ 0.0F,
    /* kCoverageShort*/ 0.0F,
    /* kClutterShort */ -2.0F,
    /* kOwnWidth     */ -3.0F,
    /* kOwnBend      */ -1.0F,
    /* kOwnEnd       */ -1.0F,
};

}  // namespace

std::array<float, Evidence::kCount>& dev_weights() { return kWeights; }

float weigh_evidence(const Evidence& evidence) noexcept {
  float sum = 0.0F;
  for (std::size_t i = 0; i < kWeights.size(); ++i) sum += kWeights[i] * evidence.of[i];
  return sum;
}

}  // namespace striper::detail
