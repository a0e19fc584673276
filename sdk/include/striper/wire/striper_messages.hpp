// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <striper/wire/ros_messages.hpp>

// Striper's own messages. Their fields are frozen (CONVENTIONS.md, "Messages"): files hold them.
namespace striper::wire {

/// striper_msgs/msg/PolarScan: a scan as it is, an entry of each array per scan line of the image.
struct PolarScan {
  Header header;  ///< Exposure midpoint; the head's frame of this laser.
  std::uint64_t sequence = 0;
  std::int64_t monotonic_ns = 0;
  bool has_utc = false;
  std::int64_t utc_offset_ns = 0;  ///< 0 where there is none.
  std::uint8_t laser = 0;
  std::uint8_t field =
      0;  ///< 0 progressive, 1 top, 2 bottom, 3 and 4 interlaced, top or bottom first.
  std::uint8_t axis = 0;  ///< 0 columns, 1 rows.
  std::vector<double> u_px;
  std::vector<double> v_px;
  std::vector<double> bearing_rad;
  std::vector<double> range_m;
  std::vector<double> range_near_m;
  std::vector<double> range_far_m;
  std::vector<double> sigma_m;
  std::vector<double> sigma_cal_m;
  std::vector<double> x_m;
  std::vector<double> y_m;
  std::vector<float> intensity;
  std::vector<float> width_px;
  std::vector<float> row_sigma_px;
  std::vector<float> confidence;
  std::vector<std::uint8_t> status;  ///< `return_code`.
};

/// striper_msgs/msg/FrameInfo: what a frame has beside its pixels; the columns of frames.csv.
struct FrameInfo {
  std::uint64_t sequence = 0;
  std::uint8_t exposure_in_picture = 0;
  std::uint8_t exposures_per_picture = 1;
  std::int64_t monotonic_ns = 0;
  bool has_utc = false;
  std::int64_t utc_offset_ns = 0;  ///< 0 where there is none.
  std::int64_t field_period_ns = 0;
  std::int64_t exposure_ns = 0;
  std::int32_t illumination = -2;  ///< -2 unknown, -1 dark, else the laser.
  std::uint8_t field = 0;          ///< As in PolarScan.
  std::uint8_t bit_depth = 8;
  std::uint32_t sensor_width = 0;
  std::uint32_t sensor_height = 0;
  double grid_u_offset = 0.0;
  double grid_u_step = 1.0;
  double grid_v_offset = 0.0;
  double grid_v_step = 1.0;
  std::string cadence;
  std::uint32_t epoch = 0;
  std::uint8_t status = 0;  ///< 0 ok, 1 corrupt, 2 incomplete, 3 wrong_size.
  std::string detail;
  bool has_encoder = false;
  std::int64_t encoder_counts = 0;  ///< 0 where there are none.
};

/// striper_msgs/msg/Odometer.
struct Odometer {
  Header header;
  std::int64_t counts = 0;
  double yaw_rate_rad_s = std::numeric_limits<double>::quiet_NaN();  ///< NaN: unknown.
};

/// striper_msgs/msg/Event: something that happened (core/event.hpp).
struct Event {
  Header header;  ///< When.
  std::string code;
  std::uint8_t severity = 0;  ///< 0 info, 1 warning, 2 error, 3 refusal.
  std::string head;
  std::string message;
  std::string advice;
};

/// striper_msgs/msg/Curb: a line of curbs.csv but for what its scan is. NaN: not known.
struct Curb {
  std::uint64_t track = 0;
  std::uint8_t kind = 0;   ///< 1 up, 2 down, 3 ramp.
  std::uint8_t state = 0;  ///< 0 new, 1 tracked, 2 hidden.
  double foot_x_m = 0.0;
  double foot_y_m = 0.0;
  double top_x_m = 0.0;
  double top_y_m = 0.0;
  double lateral_m = 0.0;
  double sigma_lateral_m = 0.0;
  double sigma_cal_lateral_m = 0.0;
  double height_m = 0.0;
  double sigma_height_m = 0.0;
  double sigma_cal_height_m = 0.0;
  double confidence = 0.0;
};

/// striper_msgs/msg/Curbs: the curbs that are tracked at one scan.
struct Curbs {
  Header header;  ///< The scan's.
  std::uint64_t sequence = 0;
  std::uint8_t laser = 0;
  std::vector<Curb> curbs;
};

/// striper_msgs/msg/Object: a line of objects.csv but for what its scan is. NaN: not known.
struct Object {
  std::uint64_t track = 0;
  double x_m = 0.0;
  double y_m = 0.0;
  double sigma_x_m = 0.0;
  double sigma_y_m = 0.0;
  double corr_xy = 0.0;
  double bearing_rad = 0.0;
  double range_m = 0.0;
  double width_m = 0.0;
  double vx_m_s = 0.0;
  double vy_m_s = 0.0;
  double sigma_v_m_s = 0.0;
  double observable_rad = 0.0;
  double closing_m_s = 0.0;
  double time_to_contact_s = 0.0;
  double ttc_low_s = 0.0;
  double ttc_high_s = 0.0;
  std::uint8_t zone = 0;  ///< 0 unknown, 1 road, 2 behind_curb.
  double confidence = 0.0;
};

/// striper_msgs/msg/Objects: the objects that are tracked at one scan.
struct Objects {
  Header header;  ///< The scan's.
  std::uint64_t sequence = 0;
  std::uint8_t laser = 0;
  std::vector<Object> objects;
};

}  // namespace striper::wire
