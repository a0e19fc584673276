// SPDX-License-Identifier: Apache-2.0
#include "guide/console/console_lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "guide/console/console_view.hpp"
#include "guide/console/text_canvas.hpp"

namespace striper::program {
namespace {

using Words = std::vector<std::string>;

std::string joined(const std::vector<std::string>& lines) {
  return fmt::format("{}", fmt::join(lines, "\n"));
}

std::string parameters_text(const GuideConsole& console) {
  return fmt::format("Laser beam : {}\n{}", console.run().is_laser_on() ? "ON" : "OFF",
                     joined(console.parameters().lines()));
}

// What a screen of the smallest size shows of it.
std::string screen_text(const GuideConsole& console) {
  TextCanvas canvas(kConsoleRows, kConsoleColumns);
  draw_console(console, canvas);
  std::vector<std::string> lines = canvas.lines();
  for (std::string& line : lines) {
    const auto end = static_cast<std::size_t>(kConsoleColumns) - 31;
    if (line.size() > end) line.resize(end);
  }
  return joined({lines.begin() + 1, lines.end() - 2});
}

// What a setter said, or what it did.
std::string settled(GuideConsole& console, const Refusal& refusal, const std::string& done) {
  console.settle(refusal, done);
  return refusal ? fmt::format("error: {}", *refusal) : done;
}

std::string shown_and_left(GuideConsole& console) {
  if (console.mode() == ConsoleMode::kMenu) return standing_message(console);
  std::string text = screen_text(console);
  console.press({KeyPress::Key::kEscape});
  return text;
}

std::optional<std::size_t> beam_of(const GuideConsole& console, const std::string& name) {
  const auto& beams = console.parameters().config().beams;
  for (std::size_t i = 0; i < beams.size(); ++i) {
    if (beams[i].name == name) return i;
  }
  return {};
}

std::string set_number(GuideConsole& console, const std::string& text,
                       Refusal (ConsoleParameters::*set)(double), const char* what) {
  const auto number = number_of(text);
  if (!number) return fmt::format("error: '{}' is no number", text);
  return settled(console, (console.parameters().*set)(*number),
                 fmt::format("{} is {}", what, text));
}

std::string set_threshold(GuideConsole& console, const Words& words) {
  const auto beam = beam_of(console, words[1]);
  if (!beam) return fmt::format("error: there is no beam '{}'", words[1]);
  const bool is_auto = words[2] == "auto";
  const auto number = is_auto ? std::numeric_limits<double>::quiet_NaN() : number_of(words[2]);
  if (!number) return fmt::format("error: '{}' is no number", words[2]);
  return settled(console, console.parameters().set_threshold(*beam, *number),
                 fmt::format("threshold of {} is {}", words[1], words[2]));
}

std::string show_threshold(GuideConsole& console, const Words& words) {
  const auto beam = beam_of(console, words[1]);
  if (!beam) return fmt::format("error: there is no beam '{}'", words[1]);
  console.choose_beam(static_cast<int>(*beam) - static_cast<int>(console.beam()));
  console.scan_thresholds();
  return shown_and_left(console);
}

std::string calibrate(GuideConsole& console, const Words& words) {
  if (words[1] == "end") {
    if (console.mode() != ConsoleMode::kCalibrating) return "error: say calibrate FEET first";
    const Refusal refusal = console.end_calibrating();
    return refusal ? fmt::format("error: {}", *refusal) : standing_message(console);
  }
  const auto feet = number_of(words[1]);
  if (!feet || *feet < 1.0 || *feet > 52800.0) {
    return fmt::format("error: distance {} is out of range: 1 to 52800 ft", words[1]);
  }
  console.start_calibrating(*feet);
  return "started; say: calibrate end";
}

std::string follow(GuideConsole& console, const Words& words) {
  struct Choice {
    const char* word;
    FollowLine line;
  };
  for (const Choice choice :
       {Choice{"left", FollowLine::kLeft}, Choice{"right", FollowLine::kRight},
        Choice{"single", FollowLine::kSingle}}) {
    if (words[1] != choice.word) continue;
    return settled(console, console.parameters().follow(choice.line),
                   fmt::format("the {} line is followed", words[1]));
  }
  return fmt::format("error: line '{}': expected left, right or single", words[1]);
}

std::string laser(GuideConsole& console, const Words& words) {
  if (words[1] != "on" && words[1] != "off") {
    return fmt::format("error: laser '{}': expected on or off", words[1]);
  }
  console.switch_laser(words[1] == "on");
  return fmt::format("laser {}", words[1]);
}

std::string go_on_scanning(GuideConsole& console, const Words& words) {
  if (words[1] == "stop") {
    const std::string last = shown_and_left(console);
    return last.empty() ? "nothing was scanned" : last;
  }
  if (words[1] != "start")
    return fmt::format("error: continue '{}': expected start or stop", words[1]);
  console.scan_on();
  return console.mode() == ConsoleMode::kContinuous ? "scanning; say: continue stop"
                                                    : standing_message(console);
}

struct Command {
  const char* name;
  std::size_t words;
  const char* usage;
  std::function<std::string(GuideConsole&, const Words&)> act;
};

const std::vector<Command>& commands() {
  using C = GuideConsole;
  static const std::vector<Command> all{
      {"laser", 2, "laser on|off", laser},
      {"odometer", 1, "odometer", [](C& c, const Words&) { return c.odometer_text(); }},
      {"time", 2, "time HH:MM:SS",
       [](C& c, const Words& w) {
         const Refusal refusal = c.set_time(w[1]);
         return refusal ? fmt::format("error: {}", *refusal)
                        : fmt::format("the time is {}", c.clock_text());
       }},
      {"scan", 1, "scan",
       [](C& c, const Words&) {
         c.scan_once();
         return shown_and_left(c);
       }},
      {"continue", 2, "continue start|stop", go_on_scanning},
      {"lateral", 1, "lateral",
       [](C& c, const Words&) {
         return c.mode() == ConsoleMode::kContinuous
                    ? screen_text(c)
                    : std::string("error: say continue start first");
       }},
      {"threshold", 2, "threshold BEAM", show_threshold},
      {"threshold", 3, "threshold BEAM VALUE|auto", set_threshold},
      {"line", 2, "line left|right|single", follow},
      {"odometer-cf", 2, "odometer-cf CLKS_PER_FT",
       [](C& c, const Words& w) {
         return set_number(c, w[1], &ConsoleParameters::set_odometer, "odometer CF");
       }},
      {"calibrate", 2, "calibrate FEET|end", calibrate},
      {"window", 2, "window SIZE",
       [](C& c, const Words& w) {
         return set_number(c, w[1], &ConsoleParameters::set_window, "window size");
       }},
      {"points", 2, "points NUMBER",
       [](C& c, const Words& w) {
         return set_number(c, w[1], &ConsoleParameters::set_points, "points per scan");
       }},
      {"width", 2, "width POINTS",
       [](C& c, const Words& w) {
         return set_number(c, w[1], &ConsoleParameters::set_stripe_width, "stripe width");
       }},
      {"parameters", 1, "parameters", [](C& c, const Words&) { return parameters_text(c); }},
      {"exit", 1, "exit",
       [](C& c, const Words&) {
         c.leave(false);
         return std::string();
       }},
      {"quit", 1, "quit",
       [](C& c, const Words&) {
         c.leave(true);
         return std::string("laser off");
       }},
  };
  return all;
}

Words words_of(std::string_view line) {
  Words words;
  for (std::size_t at = line.find_first_not_of(" \t\r"); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
    words.emplace_back(line.substr(at, end - at));
    at = line.find_first_not_of(" \t\r", end);
  }
  return words;
}

}  // namespace

std::string standing_message(const GuideConsole& console) {
  const auto* const message = console.message();
  return message == nullptr ? std::string()
                            : fmt::format("{}: {}", to_string(message->level), message->text);
}

std::string line_help() {
  std::string text = "commands:";
  for (const Command& command : commands()) text += fmt::format("\n  {}", command.usage);
  return text + "\n  wait SECONDS\n  help";
}

std::string answer_line(GuideConsole& console, std::string_view line) {
  const Words words = words_of(line);
  if (words.empty()) return {};
  if (words[0] == "help") return line_help();
  std::vector<std::string> usages;
  for (const Command& command : commands()) {
    if (words[0] != command.name) continue;
    if (words.size() == command.words) return command.act(console, words);
    usages.emplace_back(command.usage);
  }
  if (!usages.empty()) {
    return fmt::format("error: '{}': expected {}", line, fmt::join(usages, ", or "));
  }
  return fmt::format("error: '{}' is no command; say help", line);
}

}  // namespace striper::program
