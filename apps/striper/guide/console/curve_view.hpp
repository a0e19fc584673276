// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/guidance/beam_sweep.hpp>
#include <striper/guidance/guidance_config.hpp>

#include "guide/console/text_canvas.hpp"

namespace striper::program {

/// Where a curve is drawn.
struct CurveArea {
  int row = 0;
  int column = 0;
  int rows = 0;
  int columns = 0;
};

/// Draws one sweep over its window: `*` the highest sample of a column, `-` the threshold, under it
/// `^` the edges of each line that is found and `+` its middle; in the title the beam, the
/// threshold and where the first line's middle is.
void draw_curve(const BeamSweep& sweep, const GuidanceBeam& beam, double stripe_width_m,
                const CurveArea& area, TextCanvas& canvas);

}  // namespace striper::program
