// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include <striper/core/csv_table.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper::detail {

/// One line of a scans CSV: a return, and which scan it is of.
struct ScanRow {
  std::uint64_t frame = 0;
  double time_s = 0.0;
  int laser = 0;
  Return point;
};

/// The table's columns (CONVENTIONS.md, Scans as CSV).
std::span<const CsvColumn<ScanRow>> scan_columns();

}  // namespace striper::detail
