// SPDX-License-Identifier: Apache-2.0
// striper guide console: the operator's console of the 1991 report, on a terminal or line by line.
#include "guide/console/guide_console.hpp"

#include <algorithm>
#include <array>
#include <iostream>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "guide/console/console_lines.hpp"
#include "guide/console/console_screen.hpp"
#include "guide/guide_commands.hpp"
#include "options/option_bounds.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"

namespace striper::program {
namespace {

struct ConsoleArguments {
  std::string run;
  double step_s = 0.0;
  bool lines = false;
  bool no_colour = false;
};

constexpr const char* kDescription =
    "The operator's console: laser, odometer, scans, thresholds, parameters, lateral display.";

constexpr const char* kHelp =
    "RUN is the directory of a run; it goes on with the clock. What is set is checked at once and "
    "kept\n"
    "in its guidance.yaml. The screen needs 80 x 24, also over ssh, also without colour (NO_COLOR "
    "is\n"
    "respected). Without a terminal, or with --lines, the same functions are lines: type help; the "
    "run\n"
    "then goes on by `wait SECONDS`.\n\n"
    "Examples:\n"
    "  striper guide console run\n"
    "  echo parameters | striper guide console run --lines";

void define(Command& command, ConsoleArguments& arguments) {
  command.add_option("RUN", arguments.run, "The directory of the run")->required();
  command
      .add_option("--step", arguments.step_s,
                  "The run stands and goes on by this with each `.`, seconds")
      ->type_name("S")
      ->check(between(0.001, 3600.0));
  command.add_flag("--lines", arguments.lines, "No screen: a line of text is a function");
  command.add_flag("--no-colour", arguments.no_colour, "Signs and words alone");
  command.footer(kHelp);
}

// `wait` is the lines' own: on a screen the clock goes on by itself.
std::string answer(GuideConsole& console, const std::string& line, double& now_s) {
  constexpr std::string_view kWait = "wait ";
  if (!line.starts_with(kWait)) return answer_line(console, line);
  const auto seconds = number_of(std::string_view(line).substr(kWait.size()));
  if (!seconds || *seconds < 0.0 || *seconds > 86400.0) {
    return fmt::format("error: '{}': expected 0 to 86400 seconds", line);
  }
  const std::string before = standing_message(console);
  now_s += *seconds;
  console.go_on(now_s, *seconds);
  const std::string now = standing_message(console);
  return now == before ? std::string() : now;
}

// Lines of the standard input, whoever gives them and however slowly: a program that is told to end
// waits for none.
class InputLines {
 public:
  bool next(std::string& line) {
    std::size_t end = 0;
    while ((end = read_.find('\n')) == std::string::npos) {
      if (!read_more()) {
        line = std::exchange(read_, {});
        return !line.empty() && !stop_requested();
      }
    }
    line = read_.substr(0, end);
    read_.erase(0, end + 1);
    return true;
  }

 private:
  bool read_more() {
    constexpr int kLook_ms = 50;
    pollfd input{STDIN_FILENO, POLLIN, 0};
    while (!stop_requested() && ::poll(&input, 1, kLook_ms) <= 0) {
    }
    std::array<char, 4096> bytes{};
    const ssize_t got = stop_requested() ? 0 : ::read(STDIN_FILENO, bytes.data(), bytes.size());
    if (got > 0) read_.append(bytes.data(), static_cast<std::size_t>(got));
    return got > 0;
  }

  std::string read_;
};

// Returns whether every line was done.
bool run_lines(GuideConsole& console) {
  bool is_all_done = true;
  double now_s = 0.0;
  console.go_on(now_s, 0.0);
  InputLines input;
  std::string line;
  while (!console.is_over() && !stop_requested() && input.next(line)) {
    const std::string said = answer(console, line, now_s);
    is_all_done = is_all_done && !said.starts_with("error: ");
    if (!said.empty()) std::cout << said << std::endl;
  }
  if (!console.is_over()) console.leave(true);
  return is_all_done;
}

ExitCode guide_console(const ConsoleArguments& arguments) {
  const TerminalEvents events;
  GuideConsole console(arguments.run, events.port());
  const bool is_terminal = isatty(STDIN_FILENO) != 0 && isatty(STDOUT_FILENO) != 0;
  if (arguments.lines || !is_terminal || !has_console_screen()) {
    return run_lines(console) ? ExitCode::kDone : ExitCode::kFailed;
  }
  show_no_progress();
  run_console_screen(console, {arguments.step_s, !arguments.no_colour});
  return ExitCode::kDone;
}

}  // namespace

void add_guide_console(Command& guide, Action& action) {
  add_command<ConsoleArguments>(guide, action, "console", kDescription, define, guide_console);
}

}  // namespace striper::program
