// SPDX-License-Identifier: Apache-2.0
#include "program/terminal.hpp"

#include <algorithm>
#include <cctype>
#include <mutex>
#include <string>

#include <fmt/format.h>
#include <unistd.h>

#include "program/program.hpp"

namespace striper::program {
namespace {

constexpr std::string_view kClearLine = "\r\x1b[K";
constexpr auto kDrawInterval = std::chrono::milliseconds(100);
constexpr std::uint64_t kBarWidth = 24;

std::mutex terminal_mutex;
bool progress_is_wanted = true;
bool line_is_open = false;  // A progress line stands where the next message would go.

// Past the buffers of stdio, in one write, so that lines of several threads never mix.
void write_to_stderr(const std::string& text) {
  [[maybe_unused]] const ssize_t ignored = ::write(STDERR_FILENO, text.data(), text.size());
}

std::string bar(std::uint64_t done, std::uint64_t total) {
  const std::uint64_t full = kBarWidth * std::min(done, total) / std::max<std::uint64_t>(total, 1);
  return fmt::format("[{:=<{}}{: <{}}]", "", full, "", kBarWidth - full);
}

// What a broken file holds is quoted in messages and must not command the terminal.
std::string printable(std::string_view message) {
  std::string text;
  text.reserve(message.size());
  for (const char c : message) {
    if (c == '\n' || c == '\t' || std::iscntrl(static_cast<unsigned char>(c)) == 0)
      text += c;
    else
      text += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  }
  return text;
}

}  // namespace

void say(std::string_view message) {
  const std::lock_guard lock(terminal_mutex);
  write_to_stderr(fmt::format("{}{}\n", line_is_open ? kClearLine : "", printable(message)));
  line_is_open = false;
}

std::string count(std::uint64_t number, std::string_view what) {
  return fmt::format("{} {}{}", number, what, number == 1 ? "" : "s");
}

std::string shell_word(std::string_view word) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c > 0x7f ||
           std::string_view("_./:=,@%+-").find(static_cast<char>(c)) != std::string_view::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), is_plain)) return std::string(word);
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

void show_no_progress() noexcept { progress_is_wanted = false; }

Progress::Progress(std::string_view what, std::optional<std::uint64_t> total)
    : what_(what), total_(total), is_shown_(progress_is_wanted && ::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  const std::lock_guard lock(terminal_mutex);
  if (line_is_open) write_to_stderr(std::string(kClearLine));
  line_is_open = false;
}

bool Progress::go_on(std::uint64_t done) {
  update(done);
  return !stop_requested();
}

void Progress::update(std::uint64_t done) {
  const Clock::time_point now = Clock::now();
  if (!is_shown_ || now - last_drawn_ < kDrawInterval) return;
  last_drawn_ = now;

  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  const double rate_hz = elapsed_s > 0.0 ? static_cast<double>(done) / elapsed_s : 0.0;
  const std::string count =
      total_ ? fmt::format("{} {} of {} {}", bar(done, *total_), done, *total_, what_)
             : fmt::format("{} {}", done, what_);
  const std::lock_guard lock(terminal_mutex);
  write_to_stderr(fmt::format("{}{}, {:.1f}/s", kClearLine, count, rate_hz));
  line_is_open = true;
}

}  // namespace striper::program
