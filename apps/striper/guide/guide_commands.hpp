// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/commands.hpp"

namespace striper::program {

// The subcommands of `striper guide`, each in a file of its name.
void add_guide_run(Command& guide, Action& action);
void add_guide_simulate(Command& guide, Action& action);
void add_guide_evaluate(Command& guide, Action& action);
void add_guide_align(Command& guide, Action& action);
void add_guide_console(Command& guide, Action& action);
void add_guide_plan(Command& guide, Action& action);

}  // namespace striper::program
