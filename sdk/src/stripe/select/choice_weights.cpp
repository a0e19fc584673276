// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/choice_weights.hpp"

#include <algorithm>
#include <array>

namespace striper::detail {
namespace {

using K = Evidence::Kind;

// By logistic regression (ridge .3) on 650 000 candidates of 85 simulated rooms with the laser on
// and off and of 28 calibration sessions, a third of them with the width given: a candidate counts
// as the stripe within 2.5 pixels or 1.2 widths of it. The knots are quantiles chosen by eye.
constexpr std::array kPieceTerms{
    ChoiceTerm{K::kOne, 0.000F, -0.960F},
    ChoiceTerm{K::kLength, 0.000F, 1.972F},
    ChoiceTerm{K::kLength, 0.375F, 5.835F},
    ChoiceTerm{K::kLength, 0.625F, -5.733F},
    ChoiceTerm{K::kIsShort, 0.000F, 5.151F},
    ChoiceTerm{K::kIsShort, 0.150F, -5.072F},
    ChoiceTerm{K::kSupport, 0.000F, 1.009F},
    ChoiceTerm{K::kSupport, 0.375F, -8.079F},
    ChoiceTerm{K::kSupport, 0.625F, 2.326F},
    ChoiceTerm{K::kSupport, 0.800F, 1.667F},
    ChoiceTerm{K::kRoughness, 0.000F, -0.596F},
    ChoiceTerm{K::kRoughness, 0.200F, 2.772F},
    ChoiceTerm{K::kRoughness, 0.400F, -0.680F},
    ChoiceTerm{K::kBends, 0.000F, -0.714F},
    ChoiceTerm{K::kBends, 0.100F, -3.588F},
    ChoiceTerm{K::kBends, 0.300F, 4.630F},
    ChoiceTerm{K::kWide, 0.000F, -15.864F},
    ChoiceTerm{K::kWide, 0.100F, -3.946F},
    ChoiceTerm{K::kWide, 0.250F, 1.182F},
    ChoiceTerm{K::kWide, 0.500F, 1.169F},
    ChoiceTerm{K::kNarrow, 0.000F, -16.901F},
    ChoiceTerm{K::kNarrow, 0.100F, 0.089F},
    ChoiceTerm{K::kNarrow, 0.250F, 0.341F},
    ChoiceTerm{K::kNarrow, 0.500F, 1.953F},
    ChoiceTerm{K::kWidthSpread, 0.000F, 2.310F},
    ChoiceTerm{K::kWidthSpread, 0.100F, -6.648F},
    ChoiceTerm{K::kWidthSpread, 0.300F, -5.165F},
    ChoiceTerm{K::kFaint, 0.000F, 3.667F},
    ChoiceTerm{K::kFaint, 0.250F, -3.261F},
    ChoiceTerm{K::kFaint, 0.750F, -0.858F},
    ChoiceTerm{K::kBright, 0.000F, 3.092F},
    ChoiceTerm{K::kBright, 0.250F, -1.962F},
    ChoiceTerm{K::kBright, 0.750F, -2.658F},
    ChoiceTerm{K::kHeightChange, 0.000F, 12.447F},
    ChoiceTerm{K::kHeightChange, 0.100F, -15.839F},
    ChoiceTerm{K::kHeightChange, 0.400F, 2.166F},
    ChoiceTerm{K::kTilt, 0.000F, 4.807F},
    ChoiceTerm{K::kTilt, 0.020F, -29.140F},
    ChoiceTerm{K::kTilt, 0.100F, 28.572F},
    ChoiceTerm{K::kSnr, 0.000F, -8.150F},
    ChoiceTerm{K::kSnr, 0.400F, 8.374F},
    ChoiceTerm{K::kSnr, 0.700F, 2.602F},
    ChoiceTerm{K::kClipped, 0.000F, 1.140F},
    ChoiceTerm{K::kCoverage, 0.000F, 11.180F},
    ChoiceTerm{K::kCoverage, 0.050F, -6.302F},
    ChoiceTerm{K::kCoverage, 0.150F, -0.356F},
    ChoiceTerm{K::kCoverage, 0.400F, -4.410F},
    ChoiceTerm{K::kClutter, 0.000F, 0.357F},
    ChoiceTerm{K::kClutter, 0.300F, -2.972F},
    ChoiceTerm{K::kClutter, 1.000F, 0.491F},
    ChoiceTerm{K::kSubtracted, 0.000F, 0.000F},
    ChoiceTerm{K::kHidden, 0.000F, -0.960F},
    ChoiceTerm{K::kHiddenSupport, 0.000F, 1.009F},
    ChoiceTerm{K::kHiddenSupport, 0.400F, 5.870F},
    ChoiceTerm{K::kClutterSupport, 0.000F, 1.662F},
    ChoiceTerm{K::kClutterSupport, 0.400F, 0.349F},
    ChoiceTerm{K::kWideKnown, 0.000F, 12.606F},
    ChoiceTerm{K::kWideKnown, 0.100F, 1.231F},
    ChoiceTerm{K::kWideKnown, 0.250F, 1.485F},
    ChoiceTerm{K::kNarrowKnown, 0.000F, 9.353F},
    ChoiceTerm{K::kNarrowKnown, 0.100F, 4.196F},
    ChoiceTerm{K::kNarrowKnown, 0.250F, 0.541F},
    ChoiceTerm{K::kCoverageShort, 0.000F, 0.435F},
    ChoiceTerm{K::kClutterShort, 0.000F, 1.248F},
    ChoiceTerm{K::kClippedBright, 0.000F, 2.111F},
    ChoiceTerm{K::kClippedBright, 0.200F, -4.333F},
    ChoiceTerm{K::kClippedBright, 0.500F, -1.005F},
};

constexpr std::array kOwnTerms{
    ChoiceTerm{K::kOwnWidth, 0.000F, 0.475F},    ChoiceTerm{K::kOwnWidth, 0.150F, -4.962F},
    ChoiceTerm{K::kOwnWidth, 0.400F, 2.153F},    ChoiceTerm{K::kOwnBend, 0.000F, 0.389F},
    ChoiceTerm{K::kOwnBend, 0.100F, -0.742F},    ChoiceTerm{K::kOwnBend, 0.400F, 0.555F},
    ChoiceTerm{K::kOwnEnd, 0.000F, 0.898F},      ChoiceTerm{K::kOwnEnd, 0.150F, -1.710F},
    ChoiceTerm{K::kOwnEnd, 0.400F, 1.971F},      ChoiceTerm{K::kOwnEnd, 0.600F, -1.025F},
    ChoiceTerm{K::kOwnOffNear, 0.000F, -1.054F}, ChoiceTerm{K::kOwnOffNear, 0.150F, 2.040F},
    ChoiceTerm{K::kOwnOffNear, 0.500F, -1.098F}, ChoiceTerm{K::kOwnOffFar, 0.000F, 0.126F},
    ChoiceTerm{K::kOwnOffFar, 0.200F, 1.015F},   ChoiceTerm{K::kOwnOffFar, 0.700F, -0.981F},
    ChoiceTerm{K::kOwnOffFar, 1.500F, -0.841F},
};

}  // namespace

std::span<const ChoiceTerm> piece_terms() noexcept { return kPieceTerms; }
std::span<const ChoiceTerm> own_terms() noexcept { return kOwnTerms; }

float weigh(std::span<const ChoiceTerm> terms, const Evidence& evidence) noexcept {
  float sum = 0.0F;
  for (const ChoiceTerm& term : terms) {
    sum += term.weight * std::max(0.0F, evidence.of[term.kind] - term.knot);
  }
  return sum;
}

}  // namespace striper::detail
