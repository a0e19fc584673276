// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace CLI {  // NOLINT: as CLI11 calls it.
class App;
}

namespace striper::program {

/// How the program ends, for scripts.
enum class ExitCode {
  kDone = 0,
  kFailed = 1,         ///< It could not be done, or not with every picture.
  kWrongUsage = 2,     ///< The command line asks for something that makes no sense.
  kUntrustworthy = 3,  ///< Refused, because the result would not be trustworthy.
};

/// What `main` runs once the whole command line is understood. May throw Error.
using Action = std::function<ExitCode()>;

// Each adds its subcommand to the program and, when that is chosen, sets `action`. One line here
// and one in main.cpp per subcommand, in the order of `striper --help`.
void add_capture(CLI::App& striper, Action& action);
void add_serve(CLI::App& striper, Action& action);
void add_record(CLI::App& striper, Action& action);
void add_calibrate(CLI::App& striper, Action& action);
void add_verify(CLI::App& striper, Action& action);
void add_why(CLI::App& striper, Action& action);
void add_noise(CLI::App& striper, Action& action);
void add_board(CLI::App& striper, Action& action);
void add_diff(CLI::App& striper, Action& action);
void add_measure(CLI::App& striper, Action& action);
void add_curb(CLI::App& striper, Action& action);
void add_objects(CLI::App& striper, Action& action);
void add_guide(CLI::App& striper, Action& action);
void add_convert(CLI::App& striper, Action& action);
void add_info(CLI::App& striper, Action& action);
void add_compare(CLI::App& striper, Action& action);
void add_design(CLI::App& striper, Action& action);
void add_eyesafe(CLI::App& striper, Action& action);
void add_simulate(CLI::App& striper, Action& action);
void add_devices(CLI::App& striper, Action& action);
void add_bench(CLI::App& striper, Action& action);
void add_doctor(CLI::App& striper, Action& action);

}  // namespace striper::program
