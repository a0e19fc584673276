// SPDX-License-Identifier: Apache-2.0
// Hears a head's topics with Fast DDS, its own generated types and its own defaults, and prints
// them as cyclone_subscriber does.
//
//   fast_dds_subscriber NAMESPACE SECONDS [best_effort]
#include <chrono>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include "heard_lines.hpp"
#include "ros2_messagesPubSubTypes.h"

namespace {

namespace fast = eprosima::fastdds::dds;
namespace diagnostic = diagnostic_msgs::msg::dds_;
namespace sensor = sensor_msgs::msg::dds_;
using nlohmann::json;
using striper::testing::hexadecimal;
using striper::testing::numbers;

json to_json(const std_msgs::msg::dds_::Header_& header) {
  return {{"sec", header.stamp().sec()},
          {"nanosec", header.stamp().nanosec()},
          {"frame_id", header.frame_id()}};
}

json to_json(const sensor::LaserScan_& m) {
  return {{"header", to_json(m.header())},
          {"angle_min", m.angle_min()},
          {"angle_max", m.angle_max()},
          {"angle_increment", m.angle_increment()},
          {"time_increment", m.time_increment()},
          {"scan_time", m.scan_time()},
          {"range_min", m.range_min()},
          {"range_max", m.range_max()},
          {"ranges", numbers(m.ranges().data(), m.ranges().size())},
          {"intensities", numbers(m.intensities().data(), m.intensities().size())}};
}

json to_json(const sensor::PointCloud2_& m) {
  json fields = json::array();
  for (const sensor::PointField_& one : m.fields()) {
    fields.push_back({one.name(), one.offset(), one.datatype(), one.count()});
  }
  return {{"header", to_json(m.header())},
          {"height", m.height()},
          {"width", m.width()},
          {"fields", fields},
          {"is_bigendian", m.is_bigendian()},
          {"point_step", m.point_step()},
          {"row_step", m.row_step()},
          {"data", hexadecimal(m.data().data(), m.data().size())},
          {"is_dense", m.is_dense()}};
}

json to_json(const sensor::CameraInfo_& m) {
  const sensor::RegionOfInterest_& roi = m.roi();
  return {{"header", to_json(m.header())},
          {"height", m.height()},
          {"width", m.width()},
          {"distortion_model", m.distortion_model()},
          {"d", m.d()},
          {"k", m.k()},
          {"r", m.r()},
          {"p", m.p()},
          {"binning", {m.binning_x(), m.binning_y()}},
          {"roi", {roi.x_offset(), roi.y_offset(), roi.height(), roi.width(), roi.do_rectify()}}};
}

json to_json(const tf2_msgs::msg::dds_::TFMessage_& m) {
  json list = json::array();
  for (const auto& one : m.transforms()) {
    const auto& t = one.transform().translation();
    const auto& q = one.transform().rotation();
    list.push_back({{"header", to_json(one.header())},
                    {"child", one.child_frame_id()},
                    {"translation", {t.x(), t.y(), t.z()}},
                    {"rotation", {q.x(), q.y(), q.z(), q.w()}}});
  }
  return {{"transforms", list}};
}

json to_json(const diagnostic::DiagnosticArray_& m) {
  json list = json::array();
  for (const diagnostic::DiagnosticStatus_& one : m.status()) {
    json values = json::object();
    for (const diagnostic::KeyValue_& pair : one.values()) values[pair.key()] = pair.value();
    list.push_back({{"level", one.level()},
                    {"name", one.name()},
                    {"message", one.message()},
                    {"hardware_id", one.hardware_id()},
                    {"values", values}});
  }
  return {{"header", to_json(m.header())}, {"status", list}};
}

// What the writers say of their types.
using Found = eprosima::fastrtps::rtps::WriterDiscoveryInfo;

class Discovered : public fast::DomainParticipantListener {
 public:
  void on_publisher_discovery(fast::DomainParticipant* /*participant*/, Found&& found) override {
    if (found.status != Found::DISCOVERED_WRITER) return;
    const auto& data = found.info.m_qos.m_userData.data_vec();
    striper::testing::print_line({{"writer", found.info.topicName().to_string()},
                                  {"type", found.info.typeName().to_string()},
                                  {"user_data", std::string(data.begin(), data.end())}});
  }
};

struct Reader {
  virtual ~Reader() = default;
  virtual void take() = 0;
};

template <typename Message, typename Type>
class TypedReader : public Reader {
 public:
  TypedReader(fast::DomainParticipant& participant, std::string name, bool is_best_effort)
      : name_(std::move(name)), type_(new Type()) {
    type_.register_type(&participant);
    fast::Topic* topic =
        participant.create_topic("rt" + name_, type_.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    fast::Subscriber* subscriber = participant.create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
    qos.endpoint().history_memory_policy =
        eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.history().depth = 100;
    const bool is_latched = name_ == "/tf_static";
    qos.reliability().kind = is_best_effort && !is_latched ? fast::BEST_EFFORT_RELIABILITY_QOS
                                                           : fast::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind =
        is_latched ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
    reader_ = subscriber->create_datareader(topic, qos);
    if (reader_ == nullptr) throw std::runtime_error("no reader of " + name_);
  }

  void take() override {
    Message message;
    fast::SampleInfo info;
    while (reader_->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data)
        striper::testing::print_line({{"topic", name_}, {"message", to_json(message)}});
    }
  }

 private:
  std::string name_;
  fast::TypeSupport type_;
  fast::DataReader* reader_ = nullptr;
};

using Readers = std::vector<std::unique_ptr<Reader>>;

Readers subscribe(fast::DomainParticipant& participant, const std::string& ns,
                  bool is_best_effort) {
  Readers all;
  const auto add = [&](auto message, auto type, const std::string& name) {
    using Typed = TypedReader<decltype(message), decltype(type)>;
    all.push_back(std::make_unique<Typed>(participant, name, is_best_effort));
  };
  add(sensor::PointCloud2_(), sensor::PointCloud2_PubSubType(), ns + "/points");
  add(sensor::LaserScan_(), sensor::LaserScan_PubSubType(), ns + "/scan");
  add(sensor::CameraInfo_(), sensor::CameraInfo_PubSubType(), ns + "/camera_info");
  add(tf2_msgs::msg::dds_::TFMessage_(), tf2_msgs::msg::dds_::TFMessage_PubSubType(), "/tf_static");
  add(diagnostic::DiagnosticArray_(), diagnostic::DiagnosticArray_PubSubType(), "/diagnostics");
  return all;
}

}  // namespace

int main(int count, char** words) {
  if (count < 3) return 2;
  const bool is_best_effort = count > 3 && std::string(words[3]) == "best_effort";
  Discovered discovered;
  fast::DomainParticipant* participant =
      fast::DomainParticipantFactory::get_instance()->create_participant(
          0, fast::PARTICIPANT_QOS_DEFAULT, &discovered, fast::StatusMask::none());
  if (participant == nullptr) return 1;
  const Readers all = subscribe(*participant, words[1], is_best_effort);
  striper::testing::print_line({{"ready", true}});
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(std::atof(words[2]));
  while (std::chrono::steady_clock::now() < end) {
    for (const auto& one : all) one->take();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}
