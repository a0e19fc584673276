// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace striper::detail {

/// A text file of whole lines: what is given is written with one write where the system allows it,
/// and on failure the file is cut back to the last whole line. Not thread-safe.
class LineFile {
 public:
  /// Makes the file empty; "-" is the standard output. @throws Error{kIo}.
  explicit LineFile(std::string path);
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;
  ~LineFile();

  /// @throws Error{kIo} with the system's reason.
  void write(std::string_view lines);
  void close();

 private:
  [[noreturn]] void fail(const char* action, int reason) const;
  void cut_back(std::string_view lines, std::size_t done) const;

  std::string path_;
  int file_ = -1;
};

}  // namespace striper::detail
