// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "guide/console/console_parameters.hpp"
#include "guide/console/console_run.hpp"
#include "guide/console/message_board.hpp"

namespace striper::program {

/// What is typed.
struct KeyPress {
  enum class Key { kUp, kDown, kLeft, kRight, kPageUp, kPageDown, kEnter, kEscape, kErase, kSign };
  Key key = Key::kSign;
  char sign = ' ';  ///< Of kSign.
};

/// What the console is doing.
enum class ConsoleMode {
  kMenu,         ///< A menu is chosen from.
  kInput,        ///< A value is typed.
  kSingleScan,   ///< One sweep of each beam stands on the screen.
  kContinuous,   ///< Guidance runs: the lateral display.
  kThreshold,    ///< A beam's sweeps, and its threshold moved by keys.
  kCalibrating,  ///< The calibration distance is driven.
};

/// The operator's console of the 1991 report (Appendix B) without a screen: its menus, its
/// functions and what they show. Time comes from outside, so that tests have a clock of their own.
///
/// Parameters are checked where they are set and kept in guidance.yaml at once.
class GuideConsole {
 public:
  /// @param directory a recorded run; its guidance.yaml is what is shown and kept.
  /// @throws Error as `load_guidance` and `RunInputs` do.
  GuideConsole(std::filesystem::path directory, const EventPort& events);

  /// The run and the messages go on. @param now_s of a clock that never goes back
  /// @param run_seconds by which the run's own time goes on
  void go_on(double now_s, double run_seconds);
  void press(const KeyPress& press);

  // The functions, as menu and lines call them.
  void switch_laser(bool is_on);
  std::string odometer_text() const;
  Refusal set_time(std::string_view text);  ///< HH:MM or HH:MM:SS.
  void scan_once();
  void scan_on();
  void scan_thresholds();
  void move_threshold(int steps);  ///< Of the chosen beam, by hundredths of the full scale.
  void choose_beam(int steps);
  void start_calibrating(double distance_ft);
  Refusal end_calibrating();
  void leave(bool is_all);
  /// Keeps the parameters and says what became of them; a refusal is said as an error.
  void settle(const Refusal& refusal, const std::string& done);

  ConsoleParameters& parameters() noexcept { return parameters_; }
  const ConsoleParameters& parameters() const noexcept { return parameters_; }
  const ConsoleRun& run() const noexcept { return run_; }
  ConsoleMode mode() const noexcept { return mode_; }
  std::size_t beam() const noexcept { return beam_; }
  /// Sweeps that a single scan has taken.
  const std::vector<BeamSweep>& scan() const noexcept { return scan_; }
  bool is_run_over() const noexcept { return is_run_over_; }
  const MessageBoard::Message* message() const noexcept { return messages_.shown(now_s_); }
  void say(MessageLevel level, std::string text);
  std::string clock_text() const;  ///< HH:MM:SS, as it was set or as the machine has it.
  bool is_over() const noexcept { return is_over_; }
  bool take_shell_wish() noexcept { return std::exchange(wants_shell_, false); }

  // What the view draws of menus and inputs.
  struct MenuItem {
    std::string text;
    std::function<void(GuideConsole&)> act;
  };
  struct Menu {
    std::string title;
    std::vector<MenuItem> items;
  };
  struct Input {
    std::vector<std::string> lines;
    std::string prompt;
    std::string text;
    std::function<Refusal(GuideConsole&, const std::string&)> take;
  };
  std::vector<Menu> menus() const;
  std::size_t open_menu() const noexcept { return menu_; }
  bool is_menu_down() const noexcept { return is_down_; }
  std::size_t chosen_item() const noexcept { return item_; }
  const Input* input() const noexcept { return input_ ? &*input_ : nullptr; }
  const std::string& shown_box() const noexcept { return box_; }

 private:
  void press_in_menu(const KeyPress& press);
  void press_in_input(const KeyPress& press);
  void press_in_threshold(const KeyPress& press);
  void ask(Input input);
  void ask_number(const std::string& old, const std::string& prompt,
                  Refusal (ConsoleParameters::*set)(double), const std::string& done);
  void ask_distance();
  void save();
  bool needs_laser();

  std::filesystem::path directory_;
  ConsoleParameters parameters_;
  ConsoleRun run_;
  MessageBoard messages_;
  ConsoleMode mode_ = ConsoleMode::kMenu;
  std::size_t menu_ = 0;
  std::size_t item_ = 0;
  bool is_down_ = false;
  std::optional<Input> input_;
  std::string box_;  // A line in a box under the menu: the odometer.
  std::vector<BeamSweep> scan_;
  std::size_t beam_ = 0;
  double old_threshold_ = 0.0;
  std::int64_t calibration_counts_ = 0;
  double calibration_ft_ = 0.0;
  double now_s_ = 0.0;
  std::optional<double> midnight_s_;  // On the clock of `go_on`.
  bool is_run_over_ = false;
  bool is_over_ = false;
  bool wants_shell_ = false;
};

/// A whole number or one with a point, and nothing else; nothing where it is none.
std::optional<double> number_of(std::string_view text);

}  // namespace striper::program
