// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace striper {

/// A table's lines, one after the other, each as its cells (RFC 4180; line ends LF or CR LF, a byte
/// order mark is skipped, empty lines too). What a table says is `CsvReader`'s business.
///
/// At most one line and 64 KiB are in memory. Nothing is allocated once the longest line was read.
/// Not thread-safe.
class CsvInput {
 public:
  /// The longest line that is read: longer ones are not tables.
  static constexpr std::size_t kLongestLine = std::size_t{1} << 20;

  /// @throws Error{kNotFound, kIo} naming the file and the system's reason.
  static CsvInput open(const std::filesystem::path& path);
  /// A table in memory. @param name for messages.
  static CsvInput of_text(std::string name, std::string text);

  /// Goes to the next line that is not empty; false where there is none.
  /// @throws Error{kBadFile} naming file and line: a quote where none may be, a line that is too
  ///         long, a null byte; Error{kIo}.
  bool next();

  /// Of the line; valid until `next`.
  std::span<const std::string_view> cells() const noexcept { return cells_; }
  /// The line's number in the file, from 1; where it goes over several, the first.
  std::size_t line() const noexcept { return line_; }
  /// False for a last line without a line end: it may have been cut off anywhere.
  bool is_ended() const noexcept { return is_ended_; }
  const std::string& name() const noexcept { return name_; }

  /// @throws Error{kBadFile} "'FILE' line N: MESSAGE".
  [[noreturn]] void refuse(const std::string& message) const;

 private:
  CsvInput() = default;
  bool read_more();
  std::size_t find_line_end();
  void split(char* begin, char* end);
  char* split_quoted(char* from, char* end);

  struct Closer {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  std::string name_;
  std::unique_ptr<std::FILE, Closer> file_;  // None: all is in the buffer.
  std::vector<char> buffer_;
  std::size_t begin_ = 0;  // Of what is not yet given.
  std::size_t end_ = 0;
  std::size_t line_ = 0;
  std::size_t lines_read_ = 0;
  bool is_ended_ = true;
  std::vector<std::string_view> cells_;
};

}  // namespace striper
