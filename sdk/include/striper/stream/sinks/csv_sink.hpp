// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <striper/scan/polar_scan.hpp>

namespace striper {

/// Which returns a file gets.
struct CsvOptions {
  bool doubtful = false;  ///< Also those that are there but not to be trusted.
  bool missing = false;   ///< Also a line for every column without a return.
};

/// Whether a file may give way to scans: where there is none, an empty one, a pipe or a device, or
/// scans. Anything else, such as the model or an image file, is to be kept. @throws Error{kUsage}
/// naming it.
void require_replaceable_by_scans(const std::string& path);

/// Writes scans as CSV: RFC 4180, one header line, one line per return (CONVENTIONS.md lists the
/// columns). Floats are the shortest text that reads back to the same bits; infinity is `inf`; what
/// does not exist is an empty field.
///
/// Whole lines only: a scan is written with one write where the system allows it, and on failure
/// the file is cut back to the last whole line. Not thread-safe.
class CsvSink {
 public:
  /// Opens `path` for writing, "-" being the standard output, and writes the header.
  /// @throws Error{kIo} naming the path and the system's reason, and as
  /// `require_replaceable_by_scans` does.
  explicit CsvSink(const std::string& path, const CsvOptions& options = {});
  CsvSink(const CsvSink&) = delete;
  CsvSink& operator=(const CsvSink&) = delete;
  ~CsvSink();  ///< Closes without reporting; call `close` to hear of errors.

  /// @throws Error{kIo} where the disk is full, the pipe closed, ...
  void write(const PolarScan& scan);

  /// Flushes and closes. @throws Error{kIo}.
  void close();

  std::uint64_t lines() const noexcept { return lines_; }

 private:
  struct Table;

  CsvOptions options_;
  std::unique_ptr<Table> table_;
  std::uint64_t lines_ = 0;
};

}  // namespace striper
