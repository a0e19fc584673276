// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace striper::program {

class Command;

/// How the program ends, for scripts.
enum class ExitCode {
  kDone = 0,
  kFailed = 1,         ///< It could not be done, or not with every frame.
  kWrongUsage = 2,     ///< The command line asks for something that makes no sense.
  kUntrustworthy = 3,  ///< Refused, because the result would not be trustworthy.
};

/// What `main` runs once the whole command line is understood. May throw Error.
using Action = std::function<ExitCode()>;

// Each adds its subcommand to the program and, when that is chosen, sets `action`. One line here
// and one in main.cpp per subcommand, in the order of `striper --help`.
void add_capture(Command& striper, Action& action);
void add_serve(Command& striper, Action& action);
void add_record(Command& striper, Action& action);
void add_calibrate(Command& striper, Action& action);
void add_verify(Command& striper, Action& action);
void add_why(Command& striper, Action& action);
void add_noise(Command& striper, Action& action);
void add_board(Command& striper, Action& action);
void add_diff(Command& striper, Action& action);
void add_measure(Command& striper, Action& action);
void add_curb(Command& striper, Action& action);
void add_objects(Command& striper, Action& action);
void add_guide(Command& striper, Action& action);
void add_convert(Command& striper, Action& action);
void add_info(Command& striper, Action& action);
void add_compare(Command& striper, Action& action);
void add_design(Command& striper, Action& action);
void add_eyesafe(Command& striper, Action& action);
void add_simulate(Command& striper, Action& action);
void add_devices(Command& striper, Action& action);
void add_bench(Command& striper, Action& action);
void add_doctor(Command& striper, Action& action);

}  // namespace striper::program
