// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace striper::program {

/// Where this program keeps what outlives it: $STATE_DIRECTORY (systemd's), else
/// $XDG_STATE_HOME/striper, else ~/.local/state/striper; empty where none of these is known.
std::filesystem::path state_folder();

}  // namespace striper::program
