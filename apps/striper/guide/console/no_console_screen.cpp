// SPDX-License-Identifier: Apache-2.0
#include <striper/core/error.hpp>

#include "guide/console/console_screen.hpp"

namespace striper::program {

bool has_console_screen() noexcept { return false; }

void run_console_screen(GuideConsole& /*console*/, const ConsoleScreenOptions& /*options*/) {
  throw Error(ErrorKind::kUnsupported, "this program was built without ncurses; use --lines");
}

}  // namespace striper::program
