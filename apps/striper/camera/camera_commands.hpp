// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/commands.hpp"

namespace striper::program {

// The subcommand that is there only where GigE Vision cameras can be opened (Aravis).
void add_virtual_camera(Command& striper, Action& action);

}  // namespace striper::program
