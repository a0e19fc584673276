// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

// The messages of ROS 2 (Humble and later) that Striper sends, as plain structs with ROS's names,
// units and order of fields: ROS 2's interface packages are the source. `wire/cdr.hpp` turns them
// into bytes and back.
namespace striper::wire {

/// builtin_interfaces/msg/Time: seconds and nanoseconds since 1970, UTC.
struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  friend bool operator==(const Time&, const Time&) = default;
};

/// std_msgs/msg/Header.
struct Header {
  Time stamp;
  std::string frame_id;
};

/// sensor_msgs/msg/PointField: one value of a point, `offset` bytes from the point's begin.
struct PointField {
  static constexpr std::uint8_t kUint8 = 2;
  static constexpr std::uint8_t kFloat32 = 7;
  static constexpr std::uint8_t kFloat64 = 8;

  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = kFloat32;
  std::uint32_t count = 1;
};

/// sensor_msgs/msg/PointCloud2.
struct PointCloud2 {
  Header header;
  std::uint32_t height = 1;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = false;
};

/// sensor_msgs/msg/LaserScan: ranges at equal steps of bearing, radians and metres.
struct LaserScan {
  Header header;
  float angle_min = 0.0F;
  float angle_max = 0.0F;
  float angle_increment = 0.0F;
  float time_increment = 0.0F;
  float scan_time = 0.0F;
  float range_min = 0.0F;
  float range_max = 0.0F;
  std::vector<float> ranges;       ///< +inf where nothing is, NaN where it is doubtful.
  std::vector<float> intensities;  ///< Empty, or as long as `ranges`.
};

/// sensor_msgs/msg/Image.
struct Image {
  Header header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string encoding;  ///< mono8, mono16, bgr8, bgr16, ...
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;  ///< Bytes from row to row.
  std::vector<std::uint8_t> data;
};

/// sensor_msgs/msg/CompressedImage.
struct CompressedImage {
  Header header;
  std::string format;  ///< jpeg, png.
  std::vector<std::uint8_t> data;
};

/// sensor_msgs/msg/RegionOfInterest.
struct RegionOfInterest {
  std::uint32_t x_offset = 0;
  std::uint32_t y_offset = 0;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  bool do_rectify = false;
};

/// sensor_msgs/msg/CameraInfo: matrices row by row.
struct CameraInfo {
  Header header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{};
  std::array<double, 9> r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0;
  std::uint32_t binning_y = 0;
  RegionOfInterest roi;
};

/// geometry_msgs/msg/Vector3.
struct Vector3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

/// geometry_msgs/msg/Quaternion.
struct Quaternion {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  double w = 1.0;
};

/// geometry_msgs/msg/Transform.
struct Transform {
  Vector3 translation;
  Quaternion rotation;
};

/// geometry_msgs/msg/TransformStamped: maps coordinates of `child_frame_id` to `header.frame_id`.
struct TransformStamped {
  Header header;
  std::string child_frame_id;
  Transform transform;
};

/// tf2_msgs/msg/TFMessage.
struct TFMessage {
  std::vector<TransformStamped> transforms;
};

/// diagnostic_msgs/msg/KeyValue.
struct KeyValue {
  std::string key;
  std::string value;
};

/// diagnostic_msgs/msg/DiagnosticStatus.
struct DiagnosticStatus {
  static constexpr std::byte kOk{0};
  static constexpr std::byte kWarn{1};
  static constexpr std::byte kError{2};
  static constexpr std::byte kStale{3};

  std::byte level = kOk;
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<KeyValue> values;
};

/// diagnostic_msgs/msg/DiagnosticArray.
struct DiagnosticArray {
  Header header;
  std::vector<DiagnosticStatus> status;
};

}  // namespace striper::wire
