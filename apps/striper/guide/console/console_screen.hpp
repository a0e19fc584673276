// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "guide/console/guide_console.hpp"

namespace striper::program {

struct ConsoleScreenOptions {
  double step_s = 0.0;     ///< Above 0: the run goes on by it with each `.`, else with the clock.
  bool has_colour = true;  ///< Where the terminal has it.
};

/// Whether this program was built with ncurses.
bool has_console_screen() noexcept;

/// Runs the console on the terminal until its operator leaves it.
/// @throws Error{kUnsupported} without ncurses, {kDevice} where the terminal has no such screen.
void run_console_screen(GuideConsole& console, const ConsoleScreenOptions& options);

}  // namespace striper::program
