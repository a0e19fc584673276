// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include <striper/core/csv_table.hpp>
#include <striper/profile/tools.hpp>

namespace striper {

/// A line of measurements.csv: `frame,time_s,tool,value,sigma,sigma_cal,unit,points,status`
/// (CONVENTIONS.md).
struct MeasurementLine {
  std::uint64_t frame = 0;
  double time_s = 0.0;
  Measurement measurement{};
};

/// The table's columns, for CsvWriter and CsvReader.
std::span<const CsvColumn<MeasurementLine>> measurement_columns();

}  // namespace striper
