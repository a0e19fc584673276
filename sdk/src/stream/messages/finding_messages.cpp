// SPDX-License-Identifier: Apache-2.0
#include <striper/stream/messages/finding_messages.hpp>
#include <striper/stream/messages/scan_messages.hpp>

namespace striper {
namespace {

wire::Curb message_of(const CurbTrack& track) {
  wire::Curb m;
  m.track = track.id;
  m.kind = static_cast<std::uint8_t>(track.kind);
  m.state = static_cast<std::uint8_t>(track.state);
  m.foot_x_m = track.foot_m.x();
  m.foot_y_m = track.foot_m.y();
  m.top_x_m = track.top_m.x();
  m.top_y_m = track.top_m.y();
  m.lateral_m = track.lateral_m;
  m.sigma_lateral_m = track.sigma_lateral_m;
  m.sigma_cal_lateral_m = track.sigma_cal_lateral_m;
  m.height_m = track.height_m;
  m.sigma_height_m = track.sigma_height_m;
  m.sigma_cal_height_m = track.sigma_cal_height_m;
  m.confidence = track.confidence;
  return m;
}

wire::Object message_of(const ObjectLine& line) {
  const ObjectTrack& track = line.track;
  wire::Object m;
  m.track = track.id;
  m.x_m = track.position_m.x();
  m.y_m = track.position_m.y();
  m.sigma_x_m = line.sigma_x_m;
  m.sigma_y_m = line.sigma_y_m;
  m.corr_xy = line.corr_xy;
  m.bearing_rad = line.bearing_rad;
  m.range_m = line.range_m;
  m.width_m = track.width_m;
  m.vx_m_s = track.velocity_m_s.x();
  m.vy_m_s = track.velocity_m_s.y();
  m.sigma_v_m_s = track.sigma_v_m_s;
  m.observable_rad = track.observable_rad;
  m.closing_m_s = track.closing_m_s;
  m.time_to_contact_s = track.time_to_contact_s;
  m.ttc_low_s = track.ttc_low_s;
  m.ttc_high_s = track.ttc_high_s;
  m.zone = static_cast<std::uint8_t>(track.zone);
  m.confidence = track.confidence;
  return m;
}

template <typename Message>
void stamp(const ScanStamp& scan, Message& message) {
  message.header.stamp = to_stamp(scan.time);
  message.header.frame_id = scan.frame_id;
  message.sequence = scan.sequence;
  message.laser = static_cast<std::uint8_t>(scan.laser);
}

}  // namespace

void to_message(const CurbsSeen& seen, wire::Curbs& message) {
  stamp(seen.scan, message);
  message.curbs.clear();
  for (const CurbLine& line : seen.lines) message.curbs.push_back(message_of(line.track));
}

void to_message(const ObjectsSeen& seen, wire::Objects& message) {
  stamp(seen.scan, message);
  message.objects.clear();
  for (const ObjectLine& line : seen.lines) message.objects.push_back(message_of(line));
}

}  // namespace striper
