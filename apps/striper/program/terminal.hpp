// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace striper::program {

/// Writes a message for people, and a line end, to the standard error stream; a progress line that
/// stands there makes way for it. Thread-safe.
void say(std::string_view message);

/// "1 scan", "2 scans". @param what in the singular, with a regular plural.
std::string count(std::uint64_t number, std::string_view what);

/// A word as one types it into a shell: in quotes where it has blanks or the like.
std::string shell_word(std::string_view word);

/// Keeps progress lines away from now on: for when the data itself goes to the terminal.
void show_no_progress() noexcept;

/// A line on the terminal that shows how far long work is; nothing where the standard error stream
/// is no terminal. Goes away when destroyed. One at a time.
class Progress {
 public:
  /// @param what is counted, in the plural: "frames". @param total empty where it is not known.
  Progress(std::string_view what, std::optional<std::uint64_t> total);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();

  /// Draws at most ten times a second.
  void update(std::uint64_t done);

  /// The same. @return false once Ctrl-C came.
  bool go_on(std::uint64_t done);

 private:
  using Clock = std::chrono::steady_clock;

  std::string_view what_;
  std::optional<std::uint64_t> total_;
  bool is_shown_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_drawn_;
};

}  // namespace striper::program
