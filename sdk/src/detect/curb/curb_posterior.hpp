// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

#include <striper/detect/curb_finder.hpp>

namespace striper::detail {

/// Flatter is a ramp: wheelchairs take 5, garage entries 15 to 25 degrees; the faces of curbs lean
/// by at most 20 degrees, those to be driven over by 45.
inline constexpr double kLeastFace_rad = 35.0 * std::numbers::pi / 180.0;

/// How often what rises from the road is a bank or grass, before its roughness is seen.
inline constexpr double kOvergrown = 0.1;

/// A probability after evidence of so many log odds (Bayes); beyond 30 they are taken for 30.
double after(double probability, double log_odds) noexcept;

/// What is seen of something that leaves the road, besides its figures.
struct CurbEvidence {
  double gain = 0.0;      ///< By how much chi2 grows if there is nothing.
  double penalty = 25.0;  ///< What a further surface had to gain (Segmentation::penalty).
  bool is_down = false;
  bool is_ground_behind = false;  ///< The road's level is seen again farther out.
  double top_length_m = 0.0;      ///< 0 where no top is seen.
};

/// Fills kind and posterior of a finding whose figures are known.
void weigh(const CurbEvidence& evidence, const CurbOptions& options, CurbFinding& finding) noexcept;

}  // namespace striper::detail
