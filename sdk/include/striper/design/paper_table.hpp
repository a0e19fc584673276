// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <striper/design/striper_design.hpp>

namespace striper {

/// A lens of Table 1 of Mertz et al. 2002: what is printed, and what comes out here.
struct PaperLens {
  double fov_deg = 0.0;
  double printed_resolution_deg = 0.0;
  double printed_max_range_m = 0.0;
  double printed_step_m = 0.0;
  double resolution_deg = 0.0;  ///< The angle of a pixel.
  double step_m = 0.0;          ///< The outward step of a field's row at 2 m: all digits agree.
  double derivative_m = 0.0;    ///< The same by the derivative, which does not reproduce the table.
  /// The maximum range cannot be had from what the paper prints. This is a scaling fitted to the
  /// 55 degree lens, range^2 ~ 1 / tan(fov / 2), and no reproduction; its misfit is what it is off.
  double scaled_max_range_m = 0.0;
};

/// The three lenses, 30, 55 and 105 degrees. About .3 ms.
std::array<PaperLens, 3> paper_table_1();

/// The striper of the paper with one of its lenses: 640 x 480, interlaced, .5 m above a level
/// laser of 60 x .4 degrees, 10.43 uJ of 1 us at 900 nm, 1/400000 s, 25 nm; looking down at 2 m,
/// which the paper does not print and no angle per row depends on.
StriperDesign paper_striper(double fov_deg);

}  // namespace striper
