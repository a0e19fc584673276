// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "stripe/edges/edge_profile.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// Chi squared of the pixels of a profile at a model, and half its derivatives by the parameters,
/// without what is known of them beforehand.
struct EdgeNormal {
  static constexpr std::size_t kCount = EdgeModel::kCount;

  std::array<std::array<double, kCount>, kCount> information;  ///< Its lower triangle.
  std::array<double, kCount> gradient;                         ///< Towards less.
  double chi2;
  double core_chi2;  ///< Of the pixels that the stripe is on.
  int rows;          ///< How many pixels told: lit ones and dark ones.
  int core_rows;
};

/// Each pixel is weighted with the variance that the model gives it; those off the stripe, which
/// other edges disturb, count as Cauchy's distribution has it. A clipped pixel that the model
/// exceeds tells nothing. .3 us of 24 pixels; no allocation.
EdgeNormal edge_normal(const EdgeProfile& profile, const PlanNoise& noise, const EdgeModel& model,
                       EdgeKind kind) noexcept;

}  // namespace striper::detail
