// SPDX-License-Identifier: Apache-2.0
// The console on a terminal, by ncurses: all that it shows is drawn elsewhere.
#include "guide/console/console_screen.hpp"

#include <chrono>
#include <clocale>
#include <cstdlib>
#include <optional>

#include <ncurses.h>

#include <striper/core/error.hpp>

#include "guide/console/console_view.hpp"
#include "guide/console/text_canvas.hpp"
#include "program/program.hpp"

namespace striper::program {
namespace {

constexpr int kWait_ms = 50;    // For a key: drawn twenty times a second.
constexpr int kEscape_ms = 25;  // Until Esc is no longer the beginning of an arrow key.
constexpr int kEnterKey = 10;
constexpr int kReturnKey = 13;
constexpr int kEscapeKey = 27;
constexpr int kRubout = 127;
constexpr int kBackspaceKey = 8;

double clock_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The terminal, ours while it lives.
class Terminal {
 public:
  explicit Terminal(bool has_colour) {
    std::setlocale(LC_CTYPE, "");
    screen_ = newterm(nullptr, stdout, stdin);
    if (screen_ == nullptr) {
      throw Error(ErrorKind::kDevice,
                  "this terminal (TERM) has no screen that can be drawn on; use --lines");
    }
    set_term(screen_);
    set_escdelay(kEscape_ms);
    cbreak();
    noecho();
    keypad(stdscr, TRUE);
    curs_set(0);
    timeout(kWait_ms);
    is_coloured_ = has_colour && std::getenv("NO_COLOR") == nullptr && has_colors();
    if (is_coloured_) choose_colours();
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal() {
    endwin();
    delscreen(screen_);
  }

  void show(const TextCanvas& canvas) const {
    for (int row = 0; row < canvas.rows(); ++row) {
      for (int column = 0; column < canvas.columns(); ++column) {
        const TextCanvas::Cell& cell = canvas.at(row, column);
        const auto sign = static_cast<chtype>(static_cast<unsigned char>(cell.character));
        mvaddch(row, column, sign | attributes(cell.look));
      }
    }
    refresh();
  }

  // The operator's shell, until it ends.
  static void run_shell() {
    def_prog_mode();
    endwin();
    const char* const shell = std::getenv("SHELL");
    if (std::system(shell != nullptr ? shell : "/bin/sh") != 0) beep();
    reset_prog_mode();
    clear();
  }

 private:
  static void choose_colours() {
    start_color();
    use_default_colors();
    init_pair(1, COLOR_GREEN, -1);
    init_pair(2, COLOR_YELLOW, -1);
    init_pair(3, COLOR_RED, -1);
    init_pair(4, COLOR_CYAN, -1);
  }

  chtype attributes(Look look) const {
    const auto colour = [&](int pair) -> chtype {
      return is_coloured_ ? static_cast<chtype>(COLOR_PAIR(pair)) : 0;
    };
    switch (look) {
      case Look::kBar:
        return A_REVERSE;
      case Look::kChosen:
        return A_BOLD;
      case Look::kPaint:
        return A_BOLD | colour(1);
      case Look::kThreshold:
        return colour(4);
      case Look::kInformation:
        return colour(1);
      case Look::kWarning:
        return A_BOLD | colour(2);
      case Look::kError:
        return A_BOLD | A_REVERSE | colour(3);
      case Look::kPlain:
        break;
    }
    return A_NORMAL;
  }

  SCREEN* screen_ = nullptr;
  bool is_coloured_ = false;
};

std::optional<KeyPress> key_of(int code) {
  using Key = KeyPress::Key;
  switch (code) {
    case KEY_UP:
      return KeyPress{Key::kUp};
    case KEY_DOWN:
      return KeyPress{Key::kDown};
    case KEY_LEFT:
      return KeyPress{Key::kLeft};
    case KEY_RIGHT:
      return KeyPress{Key::kRight};
    case KEY_PPAGE:
      return KeyPress{Key::kPageUp};
    case KEY_NPAGE:
      return KeyPress{Key::kPageDown};
    case kEnterKey:
    case kReturnKey:
    case KEY_ENTER:
      return KeyPress{Key::kEnter};
    case kEscapeKey:
      return KeyPress{Key::kEscape};
    case KEY_BACKSPACE:
    case kRubout:
    case kBackspaceKey:
      return KeyPress{Key::kErase};
    default:
      break;
  }
  if (code < ' ' || code > '~') return {};  // A new size of the terminal, and what is no key here.
  return KeyPress{Key::kSign, static_cast<char>(code)};
}

}  // namespace

bool has_console_screen() noexcept { return true; }

void run_console_screen(GuideConsole& console, const ConsoleScreenOptions& options) {
  const Terminal terminal(options.has_colour);
  double last_s = clock_s();
  while (!console.is_over() && !stop_requested()) {
    const double now_s = clock_s();
    console.go_on(now_s, options.step_s > 0.0 ? 0.0 : now_s - last_s);
    last_s = now_s;
    TextCanvas canvas(getmaxy(stdscr), getmaxx(stdscr));
    draw_console(console, canvas);
    terminal.show(canvas);
    const int code = getch();
    const bool is_typing = console.mode() == ConsoleMode::kInput;
    if (code == '.' && options.step_s > 0.0 && !is_typing) {
      console.go_on(now_s, options.step_s);
      continue;
    }
    if (const auto press = key_of(code)) console.press(*press);
    if (console.take_shell_wish()) Terminal::run_shell();
  }
  if (!console.is_over()) console.leave(true);  // Told to end: nobody watches any more.
}

}  // namespace striper::program
