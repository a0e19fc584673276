// SPDX-License-Identifier: Apache-2.0
#include "program/program.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <unistd.h>

#include <striper/core/error.hpp>

#include "program/terminal.hpp"

namespace striper::program {
namespace {

std::atomic<bool> stop_flag = false;
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");

void request_stop(int /*signal*/) { stop_flag = true; }

void handle(int signal, void (*handler)(int), int flags) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  ::sigaction(signal, &action, nullptr);
}

// A file that is opened where a standard stream was closed (`2>&-`) would get what is meant for
// that. Closed ones are taken up so that reading and writing them still fail.
void occupy_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0) continue;
    [[maybe_unused]] const int taken =
        ::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

// Whoever started us may want an error like any other instead (`trap '' PIPE`).
bool is_pipe_error_said = false;
bool are_threads_left = false;

bool is_ignored(int signal) {
  struct sigaction action {};
  ::sigaction(signal, nullptr, &action);
  return action.sa_handler == SIG_IGN;
}

ExitCode exit_code_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kUsage:
    case ErrorKind::kBadValue:
      return ExitCode::kWrongUsage;
    case ErrorKind::kUntrustworthy:
      return ExitCode::kUntrustworthy;
    case ErrorKind::kNotFound:
    case ErrorKind::kBadFile:
    case ErrorKind::kUnsupported:
    case ErrorKind::kDevice:
    case ErrorKind::kIo:
      return ExitCode::kFailed;
  }
  return ExitCode::kFailed;
}

std::string command_name(const CLI::App& striper) {
  const std::vector<CLI::App*> chosen = striper.get_subcommands();
  return chosen.empty() ? striper.get_name() : "striper " + chosen.front()->get_name();
}

// A misspelt command is only known as something left over.
std::string explain(const CLI::App& striper, const CLI::ParseError& error) {
  const std::vector<std::string> rest = striper.remaining();
  const bool is_no_number = dynamic_cast<const CLI::ConversionError*>(&error) != nullptr;
  if (is_no_number)
    return fmt::format("{}: expected a number, whole where things are counted", error.what());
  if (!striper.get_subcommands().empty() || rest.empty()) return error.what();
  std::vector<std::string> known;
  for (const CLI::App* command : striper.get_subcommands({})) known.push_back(command->get_name());
  return fmt::format("no command '{}'; there are {}", rest.front(), fmt::join(known, ", "));
}

// A shell variable that was not set comes as an empty word; nothing here has a use for one.
void refuse_empty_words(const CLI::App& striper) {
  for (const CLI::App* command : striper.get_subcommands()) {
    for (const CLI::Option* option : command->get_options()) {
      if (option->get_inject_separator()) continue;  // Empty words are that separator.
      const std::vector<std::string>& words = option->results();
      if (std::find(words.begin(), words.end(), "") != words.end())
        throw Error(ErrorKind::kUsage, fmt::format("{} is empty", option->get_name()));
    }
  }
}

// What is still in the buffers of stdio: a full disk is told of only now.
void finish_standard_output() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  throw Error(ErrorKind::kIo, fmt::format("cannot write to the standard output: {}",
                                          std::generic_category().message(errno)));
}

bool is_reader_gone() {
  pollfd output{STDOUT_FILENO, 0, 0};
  return ::poll(&output, 1, 0) > 0 && (output.revents & (POLLERR | POLLHUP)) != 0;
}

// Files, the camera and its laser were closed on the way here. Returns where the error is another
// one.
void end_as_sigpipe_does(const Error& error) {
  const bool is_of_output =
      error.kind() == ErrorKind::kIo &&
      std::string_view(error.what()).find("standard output") != std::string_view::npos;
  if (is_pipe_error_said || !is_of_output || !is_reader_gone()) return;
  handle(SIGPIPE, SIG_DFL, 0);
  ::raise(SIGPIPE);
}

ExitCode execute(const CLI::App& striper, const Action& action) {
  const std::string name = command_name(striper);
  try {
    refuse_empty_words(striper);
    const ExitCode code = action();
    finish_standard_output();
    return code;
  } catch (const Error& error) {
    end_as_sigpipe_does(error);
    say(fmt::format("{}: {}", name, error.what()));
    return exit_code_of(error.kind());
  } catch (const std::exception& error) {
    say(fmt::format("{}: unexpected: {}", name, error.what()));
    return ExitCode::kFailed;
  }
}

WordCheck number_that(bool (*is_fit)(double), const char* otherwise) {
  return [=](const std::string& word) -> std::string {
    double number = 0.0;
    const char* const last = word.data() + word.size();
    const auto [end, error] = std::from_chars(word.data(), last, number);
    if (error == std::errc() && end == last && is_fit(number)) return {};
    return fmt::format("'{}' is {}", word, otherwise);
  };
}

}  // namespace

const char* const kSourceHelp =
    "SOURCE names where the frames come from (quote it: the shell knows ? & and * too):\n"
    "  images:DIR  images:'shots/*.png'   image files in natural order (a number that is missing\n"
    "                                     in their names is a lost frame), or a recording\n"
    "      ?fps=30  ?bits=12              their rate; significant bits of 16-bit images\n"
    "  mcap:RUN.mcap                      the frames of a recording, or anybody's images\n"
    "      ?head=left  ?realtime=yes      one of several heads; at the pace it was recorded at\n"
    "  sim:SCENE.yaml                     the simulated striper\n"
    "  v4l2:/dev/video0?standard=ntsc     a V4L2 camera or grabber\n"
    "  gige:SERIAL-or-IP?exposure_us=20   a GigE Vision camera\n"
    "  and for all of them\n"
    "      ?laser=0,dark                  the lasers' pattern, an entry per exposure; 'auto' finds "
    "it\n"
    "      ?fields=split-top              each frame is two fields, top (or split-bottom) "
    "first:\n"
    "                                     NTSC has the bottom field first, PAL the top one. A "
    "wrong\n"
    "                                     order is reported while something moves; at rest the "
    "two\n"
    "                                     orders look the same";

void prepare_process() {
  occupy_closed_streams();
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT}) {
    handle(signal, request_stop, SA_RESTART | SA_RESETHAND);
  }
  if (!is_ignored(SIGHUP)) handle(SIGHUP, request_stop, SA_RESTART | SA_RESETHAND);  // Else nohup.
  is_pipe_error_said = is_ignored(SIGPIPE);
  handle(SIGPIPE, SIG_IGN, 0);
  handle(SIGXFSZ, SIG_IGN, 0);
}

ExitCode run(CLI::App& striper, int argc, char** argv, const Action& action) {
  try {
    striper.parse(argc, argv);
  } catch (const CLI::Success& help_or_version) {
    return execute(striper, [&] {
      striper.exit(help_or_version);
      return ExitCode::kDone;
    });
  } catch (const CLI::ParseError& error) {
    const std::string name = command_name(striper);
    say(fmt::format("{}: {}\nSee {} --help", name, explain(striper, error), name));
    return ExitCode::kWrongUsage;
  }
  const ExitCode code = execute(striper, action);
  if (are_threads_left) std::_Exit(static_cast<int>(code));
  return code;
}

void leave_threads_behind() noexcept { are_threads_left = true; }

bool stop_requested() noexcept { return stop_flag; }

WordCheck one_of(std::initializer_list<std::string_view> words) {
  const std::vector<std::string_view> known(words);
  return [known](const std::string& word) -> std::string {
    if (std::find(known.begin(), known.end(), word) != known.end()) return {};
    return fmt::format("'{}' is none of {}", word, fmt::join(known, ", "));
  };
}

WordCheck above_zero() {
  return number_that([](double number) { return number > 0.0 && std::isfinite(number); },
                     "no number above 0");
}

CommandOption* add_source(Command& command, std::string& source) {
  return command.add_option("SOURCE", source, "Where the frames come from, see below")->required();
}

}  // namespace striper::program
