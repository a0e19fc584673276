// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>

#include "program/command.hpp"
#include "program/commands.hpp"

namespace striper::program {

// What every subcommand shares: process set-up, errors to exit codes, the stop signal, and the
// pieces that command lines are made of. Terminal output is in terminal.hpp, frames in
// frame_loop.hpp.

/// Sets signals: Ctrl-C stops cleanly, a closed pipe and a full quota are write errors. Call once,
/// first.
void prepare_process();

/// Parses the command line and runs the action it chose. Never throws: whatever goes wrong becomes
/// one line on the standard error stream and an exit code; a reader of the standard output that
/// went away (`| head`) ends the process as SIGPIPE does, silently.
ExitCode run(CLI::App& striper, int argc, char** argv, const Action& action);

/// Says that threads may still wait for a device that is gone, or work on what was interrupted:
/// once the output is written the process ends without its destructors. `run` then does not return.
void leave_threads_behind() noexcept;

/// Whether Ctrl-C (or SIGTERM) asked to end. A second one ends the process at once.
bool stop_requested() noexcept;

/// Adds a subcommand whose arguments live in an `Arguments` value.
/// @param define adds the options that fill it in.
/// @param execute runs when this subcommand was chosen.
template <typename Arguments>
Command& add_command(Command& striper, Action& action, const std::string& name,
                     const std::string& description,
                     const std::function<void(Command&, Arguments&)>& define,
                     ExitCode (*execute)(const Arguments&)) {
  Command& command = striper.add_subcommand(name, description);
  const auto arguments = std::make_shared<Arguments>();
  define(command, *arguments);
  command.callback([arguments, execute, &action] {
    action = [arguments, execute] { return execute(*arguments); };
  });
  return command;
}

/// Accepts these words only; the message of anything else lists them.
WordCheck one_of(std::initializer_list<std::string_view> words);

/// Accepts numbers above zero only.
WordCheck above_zero();

/// Adds the positional SOURCE, with its forms explained.
CommandOption* add_source(Command& command, std::string& source);

/// What `--help` says of every source's address.
extern const char* const kSourceHelp;

}  // namespace striper::program
