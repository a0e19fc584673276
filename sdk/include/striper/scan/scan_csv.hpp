// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <memory>

#include <striper/core/csv_file.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper {

/// What a scans CSV does not say itself.
struct ScanCsvOptions {
  StripeAxis axis = StripeAxis::kColumns;  ///< Where u_px and v_px do not show it.
  /// One-sigma error of the ranges of a table without `sigma_m`; NaN: unknown.
  double sigma_m = std::numeric_limits<double>::quiet_NaN();
};

/// Reads scans back from CSV (CONVENTIONS.md), one after the other: those that `CsvSink` wrote, to
/// the last bit, so that writing them again gives the same file; and other people's tables, of
/// which only `frame,time_s,bearing_rad,range_m` must be there. A scan is the consecutive lines of
/// one frame, time and laser.
///
/// What is missing is NaN; x and y follow from bearing and range; a line without a status is `ok`
/// where it has a range. The axis is `columns` where all u_px of a scan are whole numbers, `rows`
/// where all v_px are and the u_px not. A time from 1e8 s on (1973) is since 1970, one below is
/// since the first frame.
///
/// One scan is in memory; nothing is allocated once the largest was read. Not thread-safe.
class ScanCsvReader {
 public:
  /// @throws Error{kNotFound, kIo, kBadFile} naming the file and what is wrong with its header.
  explicit ScanCsvReader(const std::filesystem::path& path, const ScanCsvOptions& options = {});
  explicit ScanCsvReader(CsvInput input, const ScanCsvOptions& options = {});
  ScanCsvReader(ScanCsvReader&&) noexcept;
  ScanCsvReader& operator=(ScanCsvReader&&) noexcept;
  ~ScanCsvReader();

  /// Puts the next scan into `scan`, whose memory is used again; false at the end.
  /// @throws Error{kBadFile} naming file, line, column, value and what was expected; Error{kIo}.
  bool next(PolarScan& scan);

  /// The last line where it was cut off and is left out (a writer that was killed, half a copy);
  /// else 0. Known once `next` was false.
  std::size_t cut_line() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace striper
