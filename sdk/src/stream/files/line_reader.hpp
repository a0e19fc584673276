// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace striper::detail {

/// Reads a text file line by line and knows where it is. Not thread-safe.
class LineReader {
 public:
  /// @throws Error{kNotFound} or Error{kIo}.
  explicit LineReader(std::filesystem::path path);

  /// The next line, without its end, LF or CRLF; false at the end. @throws Error{kIo}.
  bool next(std::string& line);

  /// Whether the last line had an end: one without may be half of what was meant.
  bool is_ended() const noexcept { return is_ended_; }

  /// @throws Error{kBadFile} "FILE:LINE: message".
  [[noreturn]] void fail(const std::string& message) const;

  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  std::ifstream file_;
  std::uint64_t number_ = 0;
  bool is_ended_ = true;
};

}  // namespace striper::detail
