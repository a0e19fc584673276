// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <striper/stripe/stripe.hpp>

#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// Adds to `sigma_px` what the texture of a surface (wood, grain, print) does to the stripe's place
/// there, where neither a fit nor the whole frame's scatter has it.
///
/// Three signs of it, each over the 24 scan lines about a return, of which the largest counts:
/// places that scatter along the stripe more than they say, widths that do, and widths that are not
/// the stripe's, where it is known. What a texture does to the width it does to the place: the two
/// are the even and the odd part of the same light, and the noise of the pixels moves both alike.
/// So scan lines along which the texture does not change have their sign as well, and no daylight
/// is needed.
///
/// Without texture 6 us for 640 scan lines. No allocation once a frame was as large.
class TextureScatter {
 public:
  /// @param stripe one element per scan line, with the errors known so far.
  /// @param width expected, in pixels of the image. @param is_width_known whether somebody gave it:
  /// what was learnt from these scan lines says nothing of how odd they are. @param across of that
  /// image.
  void add(const WidthModel& width, bool is_width_known, const AxisGrid& across, Stripe& stripe);

 private:
  void collect(const WidthModel& width, const AxisGrid& across, const Stripe& stripe);
  void part_surfaces(float jump);
  void look_at_places();
  void look_at_widths();
  void look_at_expected();
  void take_excess(float parts);
  float excess_about(std::size_t first, std::size_t last);

  // Of each scan line; NaN where there is no good return.
  std::vector<float> across_, width_, variance_, width_variance_, odd_width_;
  std::vector<float> surface_;            // Its number.
  std::vector<float> squared_, allowed_;  // Of a difference: what it is, and what noise makes it.
  std::vector<int> known_, beyond_;       // Of each block: differences, those that are no chance.
  std::vector<float> excess_;             // Of each block, pixels^2.
  std::vector<float> scratch_;
};

}  // namespace striper::detail
