// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "commands.hpp"

namespace striper::program {

// The subcommands of `striper guide`, each in a file of its name.
void add_guide_run(CLI::App& guide, Action& action);
void add_guide_simulate(CLI::App& guide, Action& action);
void add_guide_evaluate(CLI::App& guide, Action& action);
void add_guide_align(CLI::App& guide, Action& action);
void add_guide_console(CLI::App& guide, Action& action);
void add_guide_plan(CLI::App& guide, Action& action);

}  // namespace striper::program
