// SPDX-License-Identifier: Apache-2.0
#include "guide/console/console_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <striper/core/units.hpp>

#include "guide/console/curve_view.hpp"
#include "program/terminal.hpp"

namespace striper::program {
namespace {

constexpr int kBoxColumns = 30;  // Of the parameters, on the right.
constexpr int kMenuStep = 10;    // From one menu's title to the next.
constexpr int kTop = 1;          // The row under the menu bar.

struct Area {
  int row;
  int column;
  int rows;
  int columns;
};

// What is left of the parameters, between menu bar and message.
Area work_area(const TextCanvas& canvas) {
  return {kTop, 0, canvas.rows() - 3, canvas.columns() - kBoxColumns - 1};
}

void draw_bar(const GuideConsole& console, TextCanvas& canvas) {
  canvas.put(0, 0, std::string(static_cast<std::size_t>(canvas.columns()), ' '), Look::kBar);
  const auto menus = console.menus();
  for (std::size_t i = 0; i < menus.size(); ++i) {
    const bool is_open = i == console.open_menu() && console.mode() == ConsoleMode::kMenu;
    const std::string title =
        fmt::format("{}{}{}", is_open ? '[' : ' ', menus[i].title, is_open ? ']' : ' ');
    canvas.put(0, kMenuStep * static_cast<int>(i), title, is_open ? Look::kChosen : Look::kBar);
  }
  canvas.put(0, canvas.columns() - 36, "STRIPE GUIDANCE SYSTEM", Look::kBar);
  canvas.put(0, canvas.columns() - 9, console.clock_text(), Look::kBar);
}

void draw_parameters(const GuideConsole& console, TextCanvas& canvas) {
  std::vector<std::string> lines = console.parameters().lines();
  lines.insert(lines.begin(),
               fmt::format("Laser beam : {}", console.run().is_laser_on() ? "ON" : "OFF"));
  const int column = canvas.columns() - kBoxColumns;
  canvas.box(kTop + 1, column, static_cast<int>(lines.size()) + 2, kBoxColumns, "PARAMETERS");
  for (std::size_t i = 0; i < lines.size(); ++i) {
    canvas.put(kTop + 2 + static_cast<int>(i), column + 2, lines[i].substr(0, kBoxColumns - 4));
  }
}

void draw_menu(const GuideConsole& console, TextCanvas& canvas) {
  if (!console.is_menu_down()) return;
  const auto menus = console.menus();
  const auto& menu = menus[console.open_menu()];
  const int column = kMenuStep * static_cast<int>(console.open_menu());
  std::size_t width = 0;
  for (const auto& item : menu.items) width = std::max(width, item.text.size());
  canvas.box(kTop, column, static_cast<int>(menu.items.size()) + 2, static_cast<int>(width) + 6);
  for (std::size_t i = 0; i < menu.items.size(); ++i) {
    const bool is_chosen = i == console.chosen_item();
    const std::string text = fmt::format("{} {}", is_chosen ? '>' : ' ', menu.items[i].text);
    canvas.put(kTop + 1 + static_cast<int>(i), column + 2, text,
               is_chosen ? Look::kChosen : Look::kPlain);
  }
}

// Lines in a box in the lower half of the work area.
void draw_lines(const std::vector<std::string>& lines, TextCanvas& canvas) {
  const Area area = work_area(canvas);
  const int rows = static_cast<int>(lines.size()) + 2;
  const int row = area.row + area.rows - rows;
  canvas.box(row, area.column, rows, area.columns);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    canvas.put(row + 1 + static_cast<int>(i), area.column + 2,
               lines[i].substr(0, static_cast<std::size_t>(area.columns - 4)));
  }
}

void draw_input(const GuideConsole::Input& input, TextCanvas& canvas) {
  std::vector<std::string> lines = input.lines;
  lines.emplace_back();
  lines.push_back(input.prompt + input.text + "_");
  draw_lines(lines, canvas);
}

void draw_scan(const GuideConsole& console, TextCanvas& canvas) {
  const Area area = work_area(canvas);
  const auto& beams = console.parameters().config().beams;
  const int rows = area.rows / static_cast<int>(std::max<std::size_t>(console.scan().size(), 1));
  int row = area.row;
  for (const BeamSweep& sweep : console.scan()) {
    const auto beam = std::find_if(beams.begin(), beams.end(),
                                   [&](const GuidanceBeam& one) { return one.name == sweep.beam; });
    if (beam == beams.end()) continue;
    draw_curve(sweep, *beam, console.parameters().config().stripe.width_m,
               {row, area.column, rows, area.columns}, canvas);
    row += rows;
  }
}

void draw_threshold(const GuideConsole& console, TextCanvas& canvas) {
  const Area area = work_area(canvas);
  const GuidanceBeam& beam = console.parameters().config().beams[console.beam()];
  const BeamSweep* const sweep = console.run().last_sweep(console.beam());
  if (sweep == nullptr) {
    canvas.put(area.row + 1, 2, fmt::format("beam {} has not scanned yet", beam.name));
    return;
  }
  draw_curve(*sweep, beam, console.parameters().config().stripe.width_m,
             {area.row, area.column, area.rows, area.columns}, canvas);
}

std::string state_word(PathState state) {
  constexpr std::array kWords{"tracking", "bridging", "LOST", "FAULT"};
  return kWords[static_cast<std::size_t>(state)];
}

void draw_guns(const GuideConsole& console, int row, TextCanvas& canvas) {
  const auto totals = console.run().totals();
  if (!totals) return;
  for (std::size_t i = 0; i < totals->guns.size(); ++i) {
    const bool is_on = console.run().is_gun_on(i);
    canvas.put(
        row + static_cast<int>(i), 2,
        fmt::format("Gun {:8.8} {:3} {:9.1f} ft, {}", totals->guns[i].name, is_on ? "ON" : "OFF",
                    totals->guns[i].on_m / kFoot_m,
                    totals->guns[i].dashes == 1 ? "1 dash"
                                                : fmt::format("{} dashes", totals->guns[i].dashes)),
        is_on ? Look::kPaint : Look::kPlain);
  }
}

void draw_lateral(const GuideConsole& console, TextCanvas& canvas) {
  const Area area = work_area(canvas);
  canvas.box(area.row, area.column, area.rows, area.columns, "LATERAL POSITION");
  const LateralLine* const line = console.run().lateral();
  if (line == nullptr) {
    canvas.put(area.row + 2, 2, "no scan yet");
    return;
  }
  const GuidanceBeam& beam = console.parameters().config().beams.front();
  const double half_m = std::max(beam.y_left_m, -beam.y_right_m);
  const int width = area.columns - 4;
  canvas.put(area.row + 2, 2,
             fmt::format("{:<{}}0{:>{}}", fmt::format("{:.0f}in", half_m / kInch_m), width / 2,
                         fmt::format("{:.0f}in", -half_m / kInch_m), width - width / 2 - 1));
  canvas.put(area.row + 3, 2, lateral_bar(*line, half_m, width), Look::kPaint);
  const bool is_known = std::isfinite(line->lateral_m);
  canvas.put(area.row + 5, 2,
             is_known ? fmt::format("Lateral  {:+.2f} in  +- {:.2f}", line->lateral_m / kInch_m,
                                    line->sigma_m / kInch_m)
                      : std::string("Lateral  unknown"));
  canvas.put(area.row + 6, 2, fmt::format("Output   {:+.3f} V", line->volts));
  const bool is_bad = line->state == PathState::kLost || line->state == PathState::kFault;
  canvas.put(area.row + 7, 2,
             fmt::format("State    {}, {}", state_word(line->state),
                         count(static_cast<std::uint64_t>(line->beams), "beam")),
             is_bad ? Look::kError : Look::kPlain);
  canvas.put(area.row + 8, 2, fmt::format("Distance {:.1f} ft", line->distance_m / kFoot_m));
  canvas.put(area.row + 9, 2,
             fmt::format("Speed    {:.1f} mph", console.run().motion().speed_m_s / kMph_m_s));
  draw_guns(console, area.row + 11, canvas);
}

std::string hint_of(const GuideConsole& console) {
  switch (console.mode()) {
    case ConsoleMode::kMenu:
      return "Use arrow keys to move cursor and Enter key to select.";
    case ConsoleMode::kInput:
      return "Enter takes it, Esc leaves it as it was.";
    case ConsoleMode::kSingleScan:
      return "Press 'Q' or 'Esc' to leave the scan.";
    case ConsoleMode::kContinuous:
      return "Press 'Q' or 'Esc' to quit continue scan.";
    case ConsoleMode::kThreshold:
      return "Up/down, page: threshold; left/right: beam; A: auto; Enter: keep; Q: quit";
    case ConsoleMode::kCalibrating:
      return "Press Enter when the distance is travelled; 'Q' or 'Esc' gives it up.";
  }
  return {};
}

void draw_foot(const GuideConsole& console, TextCanvas& canvas) {
  canvas.put(canvas.rows() - 1, 0, hint_of(console));
  const MessageBoard::Message* const message = console.message();
  if (message == nullptr) return;
  const Look look = message->level == MessageLevel::kError     ? Look::kError
                    : message->level == MessageLevel::kWarning ? Look::kWarning
                                                               : Look::kInformation;
  canvas.put(canvas.rows() - 2, 0, fmt::format("{}: {}", to_string(message->level), message->text),
             look);
}

void draw_calibrating(const GuideConsole& console, TextCanvas& canvas) {
  draw_lines({"CALIBRATING THE ODOMETER", console.odometer_text(), "",
              "Press Enter when the distance is travelled."},
             canvas);
}

}  // namespace

std::string lateral_bar(const LateralLine& line, double window_m, int width) {
  std::string bar(static_cast<std::size_t>(std::max(width, 1)), '.');
  const auto place = [&](double lateral_m) {
    const double share = 0.5 * (1.0 - lateral_m / window_m);
    return static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * (width - 1)));
  };
  bar[static_cast<std::size_t>(place(0.0))] = '|';
  if (!std::isfinite(line.lateral_m)) return bar;
  if (std::isfinite(line.sigma_m)) {
    const int first = place(line.lateral_m + 2.0 * line.sigma_m);
    const int last = place(line.lateral_m - 2.0 * line.sigma_m);
    for (int i = first; i <= last; ++i) bar[static_cast<std::size_t>(i)] = '=';
  }
  bar[static_cast<std::size_t>(place(line.lateral_m))] = 'O';
  return bar;
}

void draw_console(const GuideConsole& console, TextCanvas& canvas) {
  if (canvas.rows() < kConsoleRows || canvas.columns() < kConsoleColumns) {
    canvas.put(0, 0,
               fmt::format("The console needs {} x {}; this is {} x {}.", kConsoleColumns,
                           kConsoleRows, canvas.columns(), canvas.rows()));
    return;
  }
  switch (console.mode()) {
    case ConsoleMode::kSingleScan:
      draw_scan(console, canvas);
      break;
    case ConsoleMode::kContinuous:
      draw_lateral(console, canvas);
      break;
    case ConsoleMode::kThreshold:
      draw_threshold(console, canvas);
      break;
    case ConsoleMode::kCalibrating:
      draw_calibrating(console, canvas);
      break;
    case ConsoleMode::kInput:
      draw_input(*console.input(), canvas);
      break;
    case ConsoleMode::kMenu:
      draw_menu(console, canvas);
      if (!console.shown_box().empty()) draw_lines({console.shown_box()}, canvas);
      break;
  }
  draw_parameters(console, canvas);
  draw_bar(console, canvas);
  draw_foot(console, canvas);
}

}  // namespace striper::program
