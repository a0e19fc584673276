// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <striper/core/csv_table.hpp>
#include <striper/detect/curb_detector.hpp>

namespace striper {

/// A line of `curbs.csv`: one curb at one scan.
struct CurbLine {
  std::uint64_t frame = 0;
  double time_s = 0.0;
  std::string head;
  int laser = 0;
  CurbTrack track{};
};

/// The table's columns, for CsvWriter and CsvReader: `frame,time_s,head,laser,track,kind,state,
/// foot_x_m,foot_y_m,top_x_m,top_y_m,lateral_m,sigma_lateral_m,sigma_cal_lateral_m,height_m,
/// sigma_height_m,sigma_cal_height_m,confidence`. What is not known is empty.
std::span<const CsvColumn<CurbLine>> curb_columns();

}  // namespace striper
