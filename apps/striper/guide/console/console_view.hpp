// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "guide/console/guide_console.hpp"
#include "guide/console/text_canvas.hpp"

namespace striper::program {

/// Smaller screens hold no console; it says so on them.
inline constexpr int kConsoleRows = 24;
inline constexpr int kConsoleColumns = 80;

/// Draws the whole console; in a larger screen the curves are larger.
void draw_console(const GuideConsole& console, TextCanvas& canvas);

/// The lateral display as one line of `width` signs: where the stripe is between the window's ends
/// (left is left), 0, and twice its sigma to either side.
std::string lateral_bar(const LateralLine& line, double window_m, int width);

}  // namespace striper::program
