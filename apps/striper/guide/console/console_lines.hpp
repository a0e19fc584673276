// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "guide/console/guide_console.hpp"

namespace striper::program {

/// The console without a screen: one line is one function, its answer is text.
///
/// @return what it says; of what is wrong `error: ...`, of what is no command the list of all
std::string answer_line(GuideConsole& console, std::string_view line);

/// The message that stands, `LEVEL: TEXT`; empty without one.
std::string standing_message(const GuideConsole& console);

/// What `help` says.
std::string line_help();

}  // namespace striper::program
