// SPDX-License-Identifier: Apache-2.0
#include "guide/console/guide_console.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ctime>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/core/whole_file.hpp>

namespace striper::program {
namespace {

constexpr double kMile_m = 1609.344;
constexpr double kDay_s = 86400.0;
constexpr std::size_t kMostTyped = 12;

using Key = KeyPress::Key;

bool is_quit(const KeyPress& press) {
  return press.key == Key::kEscape ||
         (press.key == Key::kSign && (press.sign == 'q' || press.sign == 'Q'));
}

std::size_t stepped(std::size_t at, int step, std::size_t size) {
  const auto whole = static_cast<std::ptrdiff_t>(size);
  return static_cast<std::size_t>((static_cast<std::ptrdiff_t>(at) + step % whole + whole) % whole);
}

// HH:MM[:SS] as seconds of the day.
std::optional<double> seconds_of(std::string_view text) {
  double total_s = 0.0;
  double unit_s = 3600.0;
  for (int part = 0; part < 3 && !text.empty(); ++part, unit_s /= 60.0) {
    const std::string_view piece = text.substr(0, text.find(':'));
    text.remove_prefix(std::min(piece.size() + 1, text.size()));
    const auto number = number_of(piece);
    if (piece.size() > 2 || !number || *number >= (part == 0 ? 24.0 : 60.0) || *number < 0.0 ||
        *number != std::floor(*number)) {
      return {};
    }
    total_s += *number * unit_s;
    if (part == 0 && text.empty()) return {};
  }
  return text.empty() ? std::optional(total_s) : std::nullopt;
}

double machine_seconds() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  return local.tm_hour * 3600.0 + local.tm_min * 60.0 + local.tm_sec;
}

}  // namespace

std::optional<double> number_of(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  return is_whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

GuideConsole::GuideConsole(std::filesystem::path directory, const EventPort& events)
    : directory_(std::move(directory)),
      parameters_(load_guidance(directory_ / "guidance.yaml")),
      run_(directory_, parameters_.config(), events) {}

void GuideConsole::say(MessageLevel level, std::string text) {
  messages_.say(level, std::move(text), now_s_);
}

void GuideConsole::go_on(double now_s, double run_seconds) {
  now_s_ = now_s;
  if (!is_run_over_ && !run_.go_on(run_seconds)) {
    is_run_over_ = true;
    say(MessageLevel::kInformation, "the recorded run is at its end");
  }
  if (const auto fault = run_.take_fault()) {
    const bool is_warning = fault->action == FaultAction::kWarn;
    say(is_warning ? MessageLevel::kWarning : MessageLevel::kError,
        fmt::format("fault {}: {}", to_string(fault->code), to_string(fault->action)));
  }
}

std::vector<GuideConsole::Menu> GuideConsole::menus() const {
  const auto line = [](FollowLine which, const char* done) {
    return [which, done](GuideConsole& c) { c.settle(c.parameters_.follow(which), done); };
  };
  const auto old = [](const char* what, double value, const char* unit) {
    return fmt::format("The old {} is {:.2f} {}", what, value, unit);
  };
  const bool is_on = run_.is_laser_on();
  const char* const unit = parameters_.has_fan() ? "degrees" : "ft";
  return {
      {"File",
       {{"Shell", [](GuideConsole& c) { c.wants_shell_ = true; }},
        {"Exit", [](GuideConsole& c) { c.leave(false); }},
        {"Quit all", [](GuideConsole& c) { c.leave(true); }}}},
      {"Controls",
       {{is_on ? "Laser off" : "Laser on", [is_on](GuideConsole& c) { c.switch_laser(!is_on); }},
        {"Read odometer", [](GuideConsole& c) { c.box_ = c.odometer_text(); }},
        {"Set time",
         [](GuideConsole& c) {
           c.ask({{fmt::format("The time is {}", c.clock_text())},
                  "Please input the new time (HH:MM:SS): ",
                  {},
                  [](GuideConsole& to, const std::string& text) { return to.set_time(text); }});
         }}}},
      {"Scans",
       {{"Single scan", [](GuideConsole& c) { c.scan_once(); }},
        {"Continue scan", [](GuideConsole& c) { c.scan_on(); }},
        {"Threshold scans", [](GuideConsole& c) { c.scan_thresholds(); }}}},
      {"Parameters",
       {{"Left line", line(FollowLine::kLeft, "the left line is followed")},
        {"Right line", line(FollowLine::kRight, "the right line is followed")},
        {"Single line", line(FollowLine::kSingle, "a single line is followed")},
        {"Odometer CF", [](GuideConsole& c) { c.ask_distance(); }},
        {"Window size",
         [old, unit](GuideConsole& c) {
           c.ask_number(old("window size", c.parameters_.window(), unit),
                        fmt::format("Please input new window size in {}: ", unit),
                        &ConsoleParameters::set_window, "window size");
         }},
        {"Points/scan",
         [](GuideConsole& c) {
           c.ask_number(fmt::format("The old points per scan is {} pts",
                                    c.parameters_.config().beams.front().samples),
                        "Please input new points per scan in pts: ", &ConsoleParameters::set_points,
                        "points per scan");
         }},
        {"Stripe width",
         [](GuideConsole& c) {
           c.ask_number(
               fmt::format("The old stripe width is {:.0f} pts", c.parameters_.stripe_points()),
               "Please input new stripe width in pts: ", &ConsoleParameters::set_stripe_width,
               "stripe width");
         }}}},
  };
}

void GuideConsole::ask(Input input) {
  input_ = std::move(input);
  mode_ = ConsoleMode::kInput;
}

void GuideConsole::ask_number(const std::string& old, const std::string& prompt,
                              Refusal (ConsoleParameters::*set)(double), const std::string& done) {
  ask({{old}, prompt, {}, [set, done](GuideConsole& c, const std::string& text) -> Refusal {
         const auto number = number_of(text);
         if (!number) return fmt::format("'{}' is no number", text);
         Refusal refusal = (c.parameters_.*set)(*number);
         if (!refusal) c.settle({}, fmt::format("{} is {}", done, text));
         return refusal;
       }});
}

void GuideConsole::ask_distance() {
  ask({{"HOW TO SET OR CALIBRATE THE ODOMETER", "1. Input the distance to drive (ft),",
        "   or a factor itself as =11.73.", "2. Press Enter at the starting point.",
        "3. Press Enter at the ending point."},
       "Input calibration distance: ",
       {},
       [](GuideConsole& c, const std::string& text) -> Refusal {
         const bool is_factor = text.starts_with('=');
         const auto number = number_of(std::string_view(text).substr(is_factor ? 1 : 0));
         if (!number) return fmt::format("'{}' is no number", text);
         if (is_factor) {
           Refusal refusal = c.parameters_.set_odometer(*number);
           if (!refusal) c.settle({}, fmt::format("odometer CF is {} clks/ft", *number));
           return refusal;
         }
         if (!(*number >= 1.0 && *number <= 52800.0)) {
           return fmt::format("distance {} is out of range: 1 to 52800 ft", text);
         }
         c.ask({{fmt::format("{} ft", text)},
                "Please press Enter to start.",
                {},
                [feet = *number](GuideConsole& to, const std::string&) -> Refusal {
                  to.start_calibrating(feet);
                  return {};
                }});
         return {};
       }});
}

void GuideConsole::settle(const Refusal& refusal, const std::string& done) {
  if (refusal) return say(MessageLevel::kError, *refusal);
  save();
  say(MessageLevel::kInformation, done);
}

void GuideConsole::save() {
  try {
    write_file_atomically(directory_ / "guidance.yaml", format_guidance(parameters_.config()));
  } catch (const Error& error) {
    say(MessageLevel::kError, error.what());
  }
}

bool GuideConsole::needs_laser() {
  if (run_.is_laser_on()) return true;
  say(MessageLevel::kWarning, "the laser is off");
  return false;
}

void GuideConsole::switch_laser(bool is_on) {
  run_.set_laser(is_on);
  say(MessageLevel::kInformation, is_on ? "laser on" : "laser off");
}

std::string GuideConsole::odometer_text() const {
  const double way_m = static_cast<double>(run_.shown_counts()) /
                       std::abs(parameters_.config().odometer.counts_per_m);
  return fmt::format("Odometer: {} clks {:.2f} miles", run_.shown_counts(), way_m / kMile_m);
}

Refusal GuideConsole::set_time(std::string_view text) {
  const auto seconds = seconds_of(text);
  if (!seconds) return fmt::format("'{}' is no time: HH:MM:SS, 00:00:00 to 23:59:59", text);
  midnight_s_ = now_s_ - *seconds;
  say(MessageLevel::kInformation, "time set");
  return {};
}

std::string GuideConsole::clock_text() const {
  const double day_s = std::fmod(midnight_s_ ? now_s_ - *midnight_s_ : machine_seconds(), kDay_s);
  const int whole = static_cast<int>(day_s);
  return fmt::format("{:02}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

void GuideConsole::scan_once() {
  if (!needs_laser()) return;
  scan_.clear();
  for (std::size_t i = 0; i < parameters_.config().beams.size(); ++i) {
    if (const BeamSweep* const sweep = run_.last_sweep(i)) scan_.push_back(*sweep);
  }
  if (scan_.empty()) return say(MessageLevel::kWarning, "no beam has scanned yet");
  mode_ = ConsoleMode::kSingleScan;
}

void GuideConsole::scan_on() {
  if (!needs_laser()) return;
  const double points = parameters_.config().beams.front().samples;
  const BeamSweep* const sweep = run_.last_sweep(0);
  if (sweep != nullptr && static_cast<double>(sweep->samples.size()) != points) {
    say(MessageLevel::kWarning, "this run keeps the window and the points it was recorded with");
  }
  run_.start_guidance(parameters_.config());
  mode_ = ConsoleMode::kContinuous;
}

void GuideConsole::scan_thresholds() {
  if (!needs_laser()) return;
  old_threshold_ = parameters_.config().beams[beam_].threshold;
  mode_ = ConsoleMode::kThreshold;
}

void GuideConsole::move_threshold(int steps) {
  const double full = parameters_.full_scale(beam_);
  const double now = parameters_.config().beams[beam_].threshold;
  // From automatic it begins in the middle; beyond either end it is refused where it stands.
  const double from = std::isnan(now) ? std::round(0.5 * full) : now;
  if (const Refusal refusal =
          parameters_.set_threshold(beam_, from + std::round(0.01 * steps * full))) {
    say(MessageLevel::kError, *refusal);
  }
}

void GuideConsole::choose_beam(int steps) {
  beam_ = stepped(beam_, steps, parameters_.config().beams.size());
  old_threshold_ = parameters_.config().beams[beam_].threshold;
}

void GuideConsole::start_calibrating(double distance_ft) {
  calibration_counts_ = run_.counts();
  calibration_ft_ = distance_ft;
  mode_ = ConsoleMode::kCalibrating;
}

Refusal GuideConsole::end_calibrating() {
  mode_ = ConsoleMode::kMenu;
  Refusal refusal =
      parameters_.calibrate_odometer(run_.counts() - calibration_counts_, calibration_ft_);
  settle(refusal, fmt::format("odometer CF is {:.3f} clks/ft", parameters_.counts_per_ft()));
  return refusal;
}

void GuideConsole::leave(bool is_all) {
  if (is_all) run_.set_laser(false);
  run_.stop_guidance();
  is_over_ = true;
}

void GuideConsole::press(const KeyPress& press) {
  switch (mode_) {
    case ConsoleMode::kMenu:
      return press_in_menu(press);
    case ConsoleMode::kInput:
      return press_in_input(press);
    case ConsoleMode::kThreshold:
      return press_in_threshold(press);
    case ConsoleMode::kSingleScan:
      if (is_quit(press)) mode_ = ConsoleMode::kMenu;
      return;
    case ConsoleMode::kContinuous:
      if (!is_quit(press)) return;
      run_.stop_guidance();
      mode_ = ConsoleMode::kMenu;
      return;
    case ConsoleMode::kCalibrating:
      if (press.key == Key::kEnter) end_calibrating();
      if (is_quit(press)) mode_ = ConsoleMode::kMenu;
      return;
  }
}

void GuideConsole::press_in_menu(const KeyPress& press) {
  const std::vector<Menu> all = menus();
  const std::size_t items = all[menu_].items.size();
  box_.clear();
  switch (press.key) {
    case Key::kLeft:
    case Key::kRight:
      menu_ = stepped(menu_, press.key == Key::kRight ? 1 : -1, all.size());
      item_ = 0;
      return;
    case Key::kDown:
    case Key::kUp:
      if (is_down_) item_ = stepped(item_, press.key == Key::kDown ? 1 : -1, items);
      is_down_ = true;
      return;
    case Key::kEnter:
      if (is_down_) all[menu_].items[item_].act(*this);
      is_down_ = true;
      return;
    case Key::kEscape:
      is_down_ = false;
      return;
    default:
      return;
  }
}

void GuideConsole::press_in_input(const KeyPress& press) {
  if (press.key == Key::kEscape) {
    input_.reset();
    mode_ = ConsoleMode::kMenu;
  } else if (press.key == Key::kErase) {
    if (!input_->text.empty()) input_->text.pop_back();
  } else if (press.key == Key::kSign) {
    if (input_->text.size() < kMostTyped) input_->text += press.sign;
  } else if (press.key == Key::kEnter) {
    const Input asked = std::move(*input_);
    input_.reset();
    mode_ = ConsoleMode::kMenu;
    if (const Refusal refusal = asked.take(*this, asked.text)) {
      say(MessageLevel::kError, *refusal);
      ask(asked);  // On the spot: the same question again.
      input_->text.clear();
    }
  }
}

void GuideConsole::press_in_threshold(const KeyPress& press) {
  constexpr int kPage = 10;
  switch (press.key) {
    case Key::kUp:
    case Key::kDown:
      return move_threshold(press.key == Key::kUp ? 1 : -1);
    case Key::kPageUp:
    case Key::kPageDown:
      return move_threshold(press.key == Key::kPageUp ? kPage : -kPage);
    case Key::kLeft:
    case Key::kRight:
      return choose_beam(press.key == Key::kRight ? 1 : -1);
    case Key::kEnter:
      settle({}, fmt::format("threshold of {} is {}", parameters_.config().beams[beam_].name,
                             parameters_.threshold_text(beam_)));
      old_threshold_ = parameters_.config().beams[beam_].threshold;
      return;
    default:
      break;
  }
  if (press.key == Key::kSign && press.sign == 'a') {
    parameters_.set_threshold(beam_, std::numeric_limits<double>::quiet_NaN());
  }
  if (!is_quit(press)) return;
  parameters_.set_threshold(beam_, old_threshold_);  // What was not kept goes.
  mode_ = ConsoleMode::kMenu;
}

}  // namespace striper::program
