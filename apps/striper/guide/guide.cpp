// SPDX-License-Identifier: Apache-2.0
// striper guide: along a worn paint stripe.
#include "guide/guide_commands.hpp"
#include "program/program.hpp"

namespace striper::program {
namespace {

constexpr const char* kDescription =
    "Guide a road-marking truck along a worn paint stripe: lateral position, paint guns, dashes.";

constexpr const char* kHelp =
    "Examples:\n"
    "  striper guide plan\n"
    "  striper guide simulate data/roads/dashes.yaml -o run\n"
    "  striper guide run run -o job\n"
    "  striper guide evaluate job --truth run/truth.csv\n\n"
    "A RUN is a directory: guidance.yaml (the truck, the stripe), sweeps.csv (what each beam "
    "saw),\n"
    "odometer.csv, state.csv where there is one; CONVENTIONS.md describes them.";

}  // namespace

void add_guide(Command& striper, Action& action) {
  Command& guide = striper.add_subcommand("guide", kDescription);
  guide.require_subcommand();
  guide.footer(kHelp);
  add_guide_run(guide, action);
  add_guide_simulate(guide, action);
  add_guide_evaluate(guide, action);
  add_guide_align(guide, action);
  add_guide_console(guide, action);
  add_guide_plan(guide, action);
}

}  // namespace striper::program
