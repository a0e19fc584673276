// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <striper/core/csv_table.hpp>
#include <striper/detect/objects.hpp>

namespace striper {

/// A line of `objects.csv`: one object at one scan.
struct ObjectLine {
  std::uint64_t frame = 0;
  double time_s = 0.0;
  std::string head;
  int laser = 0;
  ObjectTrack track{};
  // What follows from the track, for the table alone.
  double sigma_x_m = ObjectTrack::kUnknown;
  double sigma_y_m = ObjectTrack::kUnknown;
  double corr_xy = ObjectTrack::kUnknown;
  double bearing_rad = ObjectTrack::kUnknown;
  double range_m = ObjectTrack::kUnknown;

  /// Takes a track as that of this line.
  void set(const ObjectTrack& track);
};

/// The table's columns, for CsvWriter and CsvReader: `frame,time_s,head,laser,track,x_m,y_m,
/// sigma_x_m,sigma_y_m,corr_xy,bearing_rad,range_m,width_m,vx_m_s,vy_m_s,sigma_v_m_s,
/// observable_rad,closing_m_s,time_to_contact_s,ttc_low_s,ttc_high_s,zone,confidence`. What is not
/// known is empty; a contact that may never come is `inf`.
std::span<const CsvColumn<ObjectLine>> object_columns();

}  // namespace striper
