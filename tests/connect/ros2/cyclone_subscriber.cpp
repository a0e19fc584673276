// SPDX-License-Identifier: Apache-2.0
// Hears a head's topics with Cyclone DDS' own generated types and prints them.
//
//   cyclone_subscriber NAMESPACE SECONDS [best_effort] [count]
//
// A line of JSON a message (heard_lines.hpp); with `count`, points as their number alone. First the
// line {"ready":true}.
#include <chrono>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <dds/dds.h>

#include "heard_lines.hpp"
#include "ros2_messages.h"

namespace {

using nlohmann::json;
using striper::testing::hexadecimal;
using striper::testing::number;
using striper::testing::numbers;

json to_json(const std_msgs_msg_dds__Header_& header) {
  return {
      {"sec", header.stamp.sec}, {"nanosec", header.stamp.nanosec}, {"frame_id", header.frame_id}};
}

json to_json(const sensor_msgs_msg_dds__LaserScan_& m) {
  return {{"header", to_json(m.header)},
          {"angle_min", m.angle_min},
          {"angle_max", m.angle_max},
          {"angle_increment", m.angle_increment},
          {"time_increment", m.time_increment},
          {"scan_time", m.scan_time},
          {"range_min", m.range_min},
          {"range_max", m.range_max},
          {"ranges", numbers(m.ranges._buffer, m.ranges._length)},
          {"intensities", numbers(m.intensities._buffer, m.intensities._length)}};
}

json to_json(const sensor_msgs_msg_dds__PointCloud2_& m) {
  json fields = json::array();
  for (std::uint32_t i = 0; i < m.fields._length; ++i) {
    const auto& field = m.fields._buffer[i];
    fields.push_back({field.name, field.offset, field.datatype, field.count});
  }
  return {{"header", to_json(m.header)},
          {"height", m.height},
          {"width", m.width},
          {"fields", fields},
          {"is_bigendian", m.is_bigendian},
          {"point_step", m.point_step},
          {"row_step", m.row_step},
          {"data", hexadecimal(m.data._buffer, m.data._length)},
          {"is_dense", m.is_dense}};
}

json to_json(const sensor_msgs_msg_dds__CameraInfo_& m) {
  return {{"header", to_json(m.header)},
          {"height", m.height},
          {"width", m.width},
          {"distortion_model", m.distortion_model},
          {"d", numbers(m.d._buffer, m.d._length)},
          {"k", numbers(m.k, 9)},
          {"r", numbers(m.r, 9)},
          {"p", numbers(m.p, 12)},
          {"binning", {m.binning_x, m.binning_y}},
          {"roi", {m.roi.x_offset, m.roi.y_offset, m.roi.height, m.roi.width, m.roi.do_rectify}}};
}

json to_json(const sensor_msgs_msg_dds__Image_& m) {
  return {{"header", to_json(m.header)},
          {"height", m.height},
          {"width", m.width},
          {"encoding", m.encoding},
          {"is_bigendian", m.is_bigendian},
          {"step", m.step},
          {"data", hexadecimal(m.data._buffer, m.data._length)}};
}

json to_json(const sensor_msgs_msg_dds__CompressedImage_& m) {
  return {{"header", to_json(m.header)},
          {"format", m.format},
          {"data", hexadecimal(m.data._buffer, m.data._length)}};
}

json to_json(const tf2_msgs_msg_dds__TFMessage_& m) {
  json list = json::array();
  for (std::uint32_t i = 0; i < m.transforms._length; ++i) {
    const auto& one = m.transforms._buffer[i];
    const auto& t = one.transform.translation;
    const auto& q = one.transform.rotation;
    list.push_back({{"header", to_json(one.header)},
                    {"child", one.child_frame_id},
                    {"translation", {t.x, t.y, t.z}},
                    {"rotation", {q.x, q.y, q.z, q.w}}});
  }
  return {{"transforms", list}};
}

json to_json(const diagnostic_msgs_msg_dds__DiagnosticArray_& m) {
  json list = json::array();
  for (std::uint32_t i = 0; i < m.status._length; ++i) {
    const auto& one = m.status._buffer[i];
    json values = json::object();
    for (std::uint32_t k = 0; k < one.values._length; ++k) {
      values[one.values._buffer[k].key] = one.values._buffer[k].value;
    }
    list.push_back({{"level", one.level},
                    {"name", one.name},
                    {"message", one.message},
                    {"hardware_id", one.hardware_id},
                    {"values", values}});
  }
  return {{"header", to_json(m.header)}, {"status", list}};
}

struct Options {
  std::string ns;
  double seconds = 0.0;
  bool is_best_effort = false;
  bool is_count = false;
};

// A topic, and how its messages are printed.
class Subscription {
 public:
  template <typename Message>
  static Subscription make(dds_entity_t participant, const dds_topic_descriptor_t& type,
                           const std::string& name, const Options& options) {
    Subscription made;
    made.name_ = name;
    made.reader_ = make_reader(participant, type, name, options.is_best_effort);
    made.print_ = [name, options](const void* sample) {
      const json message =
          options.is_count ? json(1) : to_json(*static_cast<const Message*>(sample));
      striper::testing::print_line({{"topic", name}, {"message", message}});
    };
    return made;
  }

  void take() const {
    void* sample = nullptr;
    dds_sample_info_t info{};
    while (dds_take(reader_, &sample, &info, 1, 1) > 0) {
      if (info.valid_data) print_(sample);
      dds_return_loan(reader_, &sample, 1);
      sample = nullptr;
    }
  }

 private:
  static dds_entity_t make_reader(dds_entity_t participant, const dds_topic_descriptor_t& type,
                                  const std::string& name, bool is_best_effort) {
    const dds_entity_t topic =
        dds_create_topic(participant, &type, ("rt" + name).c_str(), nullptr, nullptr);
    dds_qos_t* qos = dds_create_qos();
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 100);
    const bool is_latched = name == "/tf_static";
    const bool is_reliable = is_latched || !is_best_effort;
    dds_qset_reliability(qos, is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                         DDS_SECS(1));
    dds_qset_durability(qos, is_latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
    dds_delete_qos(qos);
    if (reader < 0) throw std::runtime_error(name + ": " + dds_strretcode(reader));
    return reader;
  }

  std::string name_;
  dds_entity_t reader_ = 0;
  std::function<void(const void*)> print_;
};

// What the writers say of their types (USER_DATA), and what their types are called.
void print_writers(dds_entity_t reader) {
  void* sample = nullptr;
  dds_sample_info_t info{};
  while (dds_take(reader, &sample, &info, 1, 1) > 0) {
    const auto& one = *static_cast<const dds_builtintopic_endpoint_t*>(sample);
    void* data = nullptr;
    std::size_t size = 0;
    if (info.valid_data && dds_qget_userdata(one.qos, &data, &size)) {
      const std::string text(static_cast<const char*>(data), size);
      striper::testing::print_line(
          {{"writer", one.topic_name}, {"type", one.type_name}, {"user_data", text}});
      dds_free(data);
    }
    dds_return_loan(reader, &sample, 1);
    sample = nullptr;
  }
}

std::vector<Subscription> subscribe(dds_entity_t participant, const Options& options) {
  std::vector<Subscription> all;
  all.push_back(Subscription::make<sensor_msgs_msg_dds__PointCloud2_>(
      participant, sensor_msgs_msg_dds__PointCloud2__desc, options.ns + "/points", options));
  if (options.is_count) return all;
  all.push_back(Subscription::make<sensor_msgs_msg_dds__LaserScan_>(
      participant, sensor_msgs_msg_dds__LaserScan__desc, options.ns + "/scan", options));
  all.push_back(Subscription::make<sensor_msgs_msg_dds__CameraInfo_>(
      participant, sensor_msgs_msg_dds__CameraInfo__desc, options.ns + "/camera_info", options));
  all.push_back(Subscription::make<sensor_msgs_msg_dds__Image_>(
      participant, sensor_msgs_msg_dds__Image__desc, options.ns + "/image_raw", options));
  all.push_back(Subscription::make<sensor_msgs_msg_dds__CompressedImage_>(
      participant, sensor_msgs_msg_dds__CompressedImage__desc, options.ns + "/image_raw/compressed",
      options));
  all.push_back(Subscription::make<tf2_msgs_msg_dds__TFMessage_>(
      participant, tf2_msgs_msg_dds__TFMessage__desc, "/tf_static", options));
  all.push_back(Subscription::make<diagnostic_msgs_msg_dds__DiagnosticArray_>(
      participant, diagnostic_msgs_msg_dds__DiagnosticArray__desc, "/diagnostics", options));
  return all;
}

}  // namespace

int main(int count, char** words) {
  if (count < 3) return 2;
  Options options{words[1], std::atof(words[2])};
  for (int i = 3; i < count; ++i) {
    options.is_best_effort = options.is_best_effort || std::string(words[i]) == "best_effort";
    options.is_count = options.is_count || std::string(words[i]) == "count";
  }
  const dds_entity_t participant = dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr);
  if (participant < 0) return 1;
  const dds_entity_t writers =
      dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
  const std::vector<Subscription> all = subscribe(participant, options);
  striper::testing::print_line({{"ready", true}});
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(options.seconds);
  while (std::chrono::steady_clock::now() < end) {
    if (!options.is_count) print_writers(writers);
    for (const Subscription& one : all) one.take();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  dds_delete(participant);
}
