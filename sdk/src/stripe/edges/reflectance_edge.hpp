// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/edges/edge_profile.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// What was found of an edge under a return.
struct EdgeFinding {
  bool is_any = false;  ///< It was looked for.
  float gain = 0.0F;    ///< As EdgeEstimate has them.
  float misfit = 0.0F;
  float contrast = 0.0F;
  float away_px = 0.0F;  ///< From the stripe's middle, pixels of the image.
};

/// Corrects returns whose stripe lies across an edge of the surface's reflectance (print, road
/// markings, wood), where its middle is drawn to the brighter side by up to 0.8 widths.
///
/// What daylight shows on either side, or in the dark exposure, and the profile's own shape tell
/// how large the step is and where; a fit of the whole gives the position, and `sigma_px` what is
/// left. Without daylight only the shape does, and the error is large. An edge of the light alone
/// (a shadow) is the other hypothesis; both have their say by their likelihood.
///
/// A clipped stripe is corrected where what is left of it fits well.
///
/// Only scan lines whose background differs between both sides, or whose width is not the stripe's,
/// are looked at; their fits cost much more than the test. No allocation after the first frame of a
/// size.
class ReflectanceEdges {
 public:
  /// @param stripe of this frame, with the errors that the noise of the pixels makes.
  void correct(const LitFrame& frame, const PlanNoise& noise, const WidthModel& width,
               Stripe& stripe);

  /// How many returns of the last frame were looked at.
  std::size_t looked_at() const noexcept { return looked_at_; }

  /// What was found under a return of the last frame, by its index.
  const EdgeFinding& finding(std::size_t i) const noexcept { return findings_[i]; }

 private:
  struct Place;
  void correct_return(const LitFrame& frame, const PlanNoise& noise, const Place& place,
                      Stripe& stripe, std::size_t i);
  EdgeEstimate find_edge(const EdgeProfile& profile, const PlanNoise& noise, const EdgePrior& prior,
                         int line);

  void learn_width(const EdgeEstimate& found, double expected);

  double width_scale_ = 1.0;  // Of the width that was learnt from most scan lines, in this frame.
  EdgeModel last_;            // Of the scan line before: edges mostly go on.
  int last_line_ = -2;
  int last_moved_line_ = -2;
  std::size_t looked_at_ = 0;
  std::vector<EdgeFinding> findings_;
};

}  // namespace striper::detail
