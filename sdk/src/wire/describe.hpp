// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

#include <striper/wire/ros_messages.hpp>
#include <striper/wire/ros_node_messages.hpp>
#include <striper/wire/striper_messages.hpp>

// The one description of each message: its type's name and its fields in order. Bytes, schema texts
// and hashes are all made from it.
namespace striper::wire {

template <typename M>
struct Description;

template <typename M>
concept Described = requires {
  Description<M>::kType;
};

#define STRIPER_MESSAGE(STRUCT, TYPE)                                  \
  template <>                                                          \
  struct Description<STRUCT> {                                         \
    static constexpr std::string_view kType = TYPE;                    \
    static constexpr std::string_view kConstants = constants_of(TYPE); \
    template <typename M, typename Visit>                              \
    static void fields(M& m, Visit&& visit);                           \
  };                                                                   \
  template <typename M, typename Visit>                                \
  void Description<STRUCT>::fields(M& m, Visit&& visit)

#define STRIPER_FIELD(NAME) visit(#NAME, m.NAME)

/// Constants that ROS 2's text of a type has; they are no part of the bytes or of the hash.
constexpr std::string_view constants_of(std::string_view type) {
  if (type == "sensor_msgs/msg/PointField") {
    return "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\n"
           "uint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\n";
  }
  if (type == "diagnostic_msgs/msg/DiagnosticStatus") {
    return "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n";
  }
  return {};
}

STRIPER_MESSAGE(Time, "builtin_interfaces/msg/Time") {
  STRIPER_FIELD(sec);
  STRIPER_FIELD(nanosec);
}

STRIPER_MESSAGE(Header, "std_msgs/msg/Header") {
  STRIPER_FIELD(stamp);
  STRIPER_FIELD(frame_id);
}

STRIPER_MESSAGE(PointField, "sensor_msgs/msg/PointField") {
  STRIPER_FIELD(name);
  STRIPER_FIELD(offset);
  STRIPER_FIELD(datatype);
  STRIPER_FIELD(count);
}

STRIPER_MESSAGE(PointCloud2, "sensor_msgs/msg/PointCloud2") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(height);
  STRIPER_FIELD(width);
  STRIPER_FIELD(fields);
  STRIPER_FIELD(is_bigendian);
  STRIPER_FIELD(point_step);
  STRIPER_FIELD(row_step);
  STRIPER_FIELD(data);
  STRIPER_FIELD(is_dense);
}

STRIPER_MESSAGE(LaserScan, "sensor_msgs/msg/LaserScan") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(angle_min);
  STRIPER_FIELD(angle_max);
  STRIPER_FIELD(angle_increment);
  STRIPER_FIELD(time_increment);
  STRIPER_FIELD(scan_time);
  STRIPER_FIELD(range_min);
  STRIPER_FIELD(range_max);
  STRIPER_FIELD(ranges);
  STRIPER_FIELD(intensities);
}

STRIPER_MESSAGE(Image, "sensor_msgs/msg/Image") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(height);
  STRIPER_FIELD(width);
  STRIPER_FIELD(encoding);
  STRIPER_FIELD(is_bigendian);
  STRIPER_FIELD(step);
  STRIPER_FIELD(data);
}

STRIPER_MESSAGE(CompressedImage, "sensor_msgs/msg/CompressedImage") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(format);
  STRIPER_FIELD(data);
}

STRIPER_MESSAGE(RegionOfInterest, "sensor_msgs/msg/RegionOfInterest") {
  STRIPER_FIELD(x_offset);
  STRIPER_FIELD(y_offset);
  STRIPER_FIELD(height);
  STRIPER_FIELD(width);
  STRIPER_FIELD(do_rectify);
}

STRIPER_MESSAGE(CameraInfo, "sensor_msgs/msg/CameraInfo") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(height);
  STRIPER_FIELD(width);
  STRIPER_FIELD(distortion_model);
  STRIPER_FIELD(d);
  STRIPER_FIELD(k);
  STRIPER_FIELD(r);
  STRIPER_FIELD(p);
  STRIPER_FIELD(binning_x);
  STRIPER_FIELD(binning_y);
  STRIPER_FIELD(roi);
}

STRIPER_MESSAGE(Vector3, "geometry_msgs/msg/Vector3") {
  STRIPER_FIELD(x);
  STRIPER_FIELD(y);
  STRIPER_FIELD(z);
}

STRIPER_MESSAGE(Quaternion, "geometry_msgs/msg/Quaternion") {
  STRIPER_FIELD(x);
  STRIPER_FIELD(y);
  STRIPER_FIELD(z);
  STRIPER_FIELD(w);
}

STRIPER_MESSAGE(Transform, "geometry_msgs/msg/Transform") {
  STRIPER_FIELD(translation);
  STRIPER_FIELD(rotation);
}

STRIPER_MESSAGE(TransformStamped, "geometry_msgs/msg/TransformStamped") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(child_frame_id);
  STRIPER_FIELD(transform);
}

STRIPER_MESSAGE(TFMessage, "tf2_msgs/msg/TFMessage") { STRIPER_FIELD(transforms); }

STRIPER_MESSAGE(KeyValue, "diagnostic_msgs/msg/KeyValue") {
  STRIPER_FIELD(key);
  STRIPER_FIELD(value);
}

STRIPER_MESSAGE(DiagnosticStatus, "diagnostic_msgs/msg/DiagnosticStatus") {
  STRIPER_FIELD(level);
  STRIPER_FIELD(name);
  STRIPER_FIELD(message);
  STRIPER_FIELD(hardware_id);
  STRIPER_FIELD(values);
}

STRIPER_MESSAGE(DiagnosticArray, "diagnostic_msgs/msg/DiagnosticArray") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(status);
}

template <std::size_t N>
struct Description<Gid<N>> {
  static constexpr std::string_view kType = "rmw_dds_common/msg/Gid";
  static constexpr std::string_view kConstants{};
  template <typename M, typename Visit>
  static void fields(M& m, Visit&& visit) {
    STRIPER_FIELD(data);
  }
};

template <std::size_t N>
struct Description<NodeEntitiesInfo<N>> {
  static constexpr std::string_view kType = "rmw_dds_common/msg/NodeEntitiesInfo";
  static constexpr std::string_view kConstants{};
  template <typename M, typename Visit>
  static void fields(M& m, Visit&& visit) {
    STRIPER_FIELD(node_namespace);
    STRIPER_FIELD(node_name);
    STRIPER_FIELD(reader_gid_seq);
    STRIPER_FIELD(writer_gid_seq);
  }
};

template <std::size_t N>
struct Description<ParticipantEntitiesInfo<N>> {
  static constexpr std::string_view kType = "rmw_dds_common/msg/ParticipantEntitiesInfo";
  static constexpr std::string_view kConstants{};
  template <typename M, typename Visit>
  static void fields(M& m, Visit&& visit) {
    STRIPER_FIELD(gid);
    STRIPER_FIELD(node_entities_info_seq);
  }
};

STRIPER_MESSAGE(PolarScan, "striper_msgs/msg/PolarScan") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(sequence);
  STRIPER_FIELD(monotonic_ns);
  STRIPER_FIELD(has_utc);
  STRIPER_FIELD(utc_offset_ns);
  STRIPER_FIELD(laser);
  STRIPER_FIELD(field);
  STRIPER_FIELD(axis);
  STRIPER_FIELD(u_px);
  STRIPER_FIELD(v_px);
  STRIPER_FIELD(bearing_rad);
  STRIPER_FIELD(range_m);
  STRIPER_FIELD(range_near_m);
  STRIPER_FIELD(range_far_m);
  STRIPER_FIELD(sigma_m);
  STRIPER_FIELD(sigma_cal_m);
  STRIPER_FIELD(x_m);
  STRIPER_FIELD(y_m);
  STRIPER_FIELD(intensity);
  STRIPER_FIELD(width_px);
  STRIPER_FIELD(row_sigma_px);
  STRIPER_FIELD(confidence);
  STRIPER_FIELD(status);
}

STRIPER_MESSAGE(FrameInfo, "striper_msgs/msg/FrameInfo") {
  STRIPER_FIELD(sequence);
  STRIPER_FIELD(exposure_in_picture);
  STRIPER_FIELD(exposures_per_picture);
  STRIPER_FIELD(monotonic_ns);
  STRIPER_FIELD(has_utc);
  STRIPER_FIELD(utc_offset_ns);
  STRIPER_FIELD(field_period_ns);
  STRIPER_FIELD(exposure_ns);
  STRIPER_FIELD(illumination);
  STRIPER_FIELD(field);
  STRIPER_FIELD(bit_depth);
  STRIPER_FIELD(sensor_width);
  STRIPER_FIELD(sensor_height);
  STRIPER_FIELD(grid_u_offset);
  STRIPER_FIELD(grid_u_step);
  STRIPER_FIELD(grid_v_offset);
  STRIPER_FIELD(grid_v_step);
  STRIPER_FIELD(cadence);
  STRIPER_FIELD(epoch);
  STRIPER_FIELD(status);
  STRIPER_FIELD(detail);
  STRIPER_FIELD(has_encoder);
  STRIPER_FIELD(encoder_counts);
}

STRIPER_MESSAGE(Odometer, "striper_msgs/msg/Odometer") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(counts);
  STRIPER_FIELD(yaw_rate_rad_s);
}

STRIPER_MESSAGE(Event, "striper_msgs/msg/Event") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(code);
  STRIPER_FIELD(severity);
  STRIPER_FIELD(head);
  STRIPER_FIELD(message);
  STRIPER_FIELD(advice);
}

STRIPER_MESSAGE(Curb, "striper_msgs/msg/Curb") {
  STRIPER_FIELD(track);
  STRIPER_FIELD(kind);
  STRIPER_FIELD(state);
  STRIPER_FIELD(foot_x_m);
  STRIPER_FIELD(foot_y_m);
  STRIPER_FIELD(top_x_m);
  STRIPER_FIELD(top_y_m);
  STRIPER_FIELD(lateral_m);
  STRIPER_FIELD(sigma_lateral_m);
  STRIPER_FIELD(sigma_cal_lateral_m);
  STRIPER_FIELD(height_m);
  STRIPER_FIELD(sigma_height_m);
  STRIPER_FIELD(sigma_cal_height_m);
  STRIPER_FIELD(confidence);
}

STRIPER_MESSAGE(Curbs, "striper_msgs/msg/Curbs") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(sequence);
  STRIPER_FIELD(laser);
  STRIPER_FIELD(curbs);
}

STRIPER_MESSAGE(Object, "striper_msgs/msg/Object") {
  STRIPER_FIELD(track);
  STRIPER_FIELD(x_m);
  STRIPER_FIELD(y_m);
  STRIPER_FIELD(sigma_x_m);
  STRIPER_FIELD(sigma_y_m);
  STRIPER_FIELD(corr_xy);
  STRIPER_FIELD(bearing_rad);
  STRIPER_FIELD(range_m);
  STRIPER_FIELD(width_m);
  STRIPER_FIELD(vx_m_s);
  STRIPER_FIELD(vy_m_s);
  STRIPER_FIELD(sigma_v_m_s);
  STRIPER_FIELD(observable_rad);
  STRIPER_FIELD(closing_m_s);
  STRIPER_FIELD(time_to_contact_s);
  STRIPER_FIELD(ttc_low_s);
  STRIPER_FIELD(ttc_high_s);
  STRIPER_FIELD(zone);
  STRIPER_FIELD(confidence);
}

STRIPER_MESSAGE(Objects, "striper_msgs/msg/Objects") {
  STRIPER_FIELD(header);
  STRIPER_FIELD(sequence);
  STRIPER_FIELD(laser);
  STRIPER_FIELD(objects);
}

#undef STRIPER_MESSAGE
#undef STRIPER_FIELD

}  // namespace striper::wire
