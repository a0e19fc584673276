// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "commands.hpp"

namespace striper::program {

// The subcommands that are there only where GigE Vision cameras can be opened (Aravis).
void add_doctor(CLI::App& striper, Action& action);
void add_virtual_camera(CLI::App& striper, Action& action);

}  // namespace striper::program
