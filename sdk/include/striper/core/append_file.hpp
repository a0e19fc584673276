// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace striper {

/// A file that grows by whole pieces only, each with one write where the system allows it: what
/// does not fit is cut off again, and what comes later follows on the last whole piece. For tables,
/// lines of JSON and recordings. Not thread-safe.
class AppendFile {
 public:
  enum class Mode {
    kReplace,  ///< An old file gives way.
    kNew,      ///< There must be none.
  };

  /// @param path "-" is the standard output. @throws Error{kIo} naming it and the system's reason.
  explicit AppendFile(std::string path, Mode mode = Mode::kReplace);
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;
  ~AppendFile();  ///< Closes without reporting; lines that were not flushed are lost.

  /// To append whole lines to; its memory is used again.
  std::string& lines() noexcept { return lines_; }

  /// Writes them, of those that do not all fit the first.
  /// @throws Error{kIo} where the disk is full, the pipe closed, ...; all of them are gone then.
  void flush();

  /// Writes all of the bytes or none. @throws Error{kIo}.
  void append(std::string_view bytes);

  /// Flushes and closes. @throws Error{kIo}.
  void close();

  const std::string& path() const noexcept { return path_; }
  bool is_open() const noexcept { return file_ >= 0; }

 private:
  void write(std::string_view bytes, bool keeps_lines);
  void cut_off(std::size_t excess) noexcept;
  [[noreturn]] void fail(const char* action, int error) const;

  std::string path_;
  int file_ = -1;
  std::string lines_;
};

}  // namespace striper
