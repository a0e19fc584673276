// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <fmt/format.h>

#include <striper/stream/messages/head_messages.hpp>

namespace striper {
namespace {

std::uint32_t at_least_zero(double value) {
  return value > 0.0 ? static_cast<std::uint32_t>(std::lround(value)) : 0;
}

// The first pixel of a region: a binned one lies in the middle of those that it was made of.
std::uint32_t first_pixel(const AxisGrid& axis) {
  return at_least_zero(axis.offset - 0.5 * (axis.step - 1.0));
}

void add_transform(std::string_view head, const std::string& child, const Eigen::Isometry3d& T,
                   wire::TFMessage& message) {
  wire::TransformStamped& one = message.transforms.emplace_back();
  one.header.frame_id = head;
  one.child_frame_id = child;
  const Eigen::Quaterniond q(T.linear());
  one.transform.translation = {T.translation().x(), T.translation().y(), T.translation().z()};
  one.transform.rotation = {q.x(), q.y(), q.z(), q.w()};
}

std::byte level_of(const ScannerStatus& status) {
  if (status.source == SourceState::kPaused) return wire::DiagnosticStatus::kWarn;
  if (status.source != SourceState::kStreaming) return wire::DiagnosticStatus::kError;
  if (status.ambient.phase == TrackingPhase::kLost) return wire::DiagnosticStatus::kError;
  const bool is_without = status.counts.scans > 0 && !status.is_stripe_seen;
  return is_without ? wire::DiagnosticStatus::kWarn : wire::DiagnosticStatus::kOk;
}

std::string message_of(const ScannerStatus& status, std::byte level) {
  if (status.source == SourceState::kWaiting) return "the source is waited for";
  if (status.source == SourceState::kSilent) return "no frame for a second or more";
  if (status.source == SourceState::kPaused) return "the source is paused";
  if (status.source == SourceState::kEnded) return "the source has ended";
  if (level == wire::DiagnosticStatus::kError) return "illumination pattern lost";
  return level == wire::DiagnosticStatus::kWarn ? "no stripe" : "scanning";
}

}  // namespace

void to_message(const StriperModel& model, std::string_view head, const PixelGrid& pixels,
                wire::CameraInfo& message) {
  const CameraModel& camera = model.camera;
  message.header.frame_id = fmt::format("{}_camera_optical", head);
  message.height = static_cast<std::uint32_t>(camera.height());
  message.width = static_cast<std::uint32_t>(camera.width());
  message.distortion_model = to_string(camera.lens());
  message.d = camera.distortion();
  message.k = {camera.fx(), 0, camera.cx(), 0, camera.fy(), camera.cy(), 0, 0, 1};
  message.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  message.p = {camera.fx(), 0, camera.cx(), 0, 0, camera.fy(), camera.cy(), 0, 0, 0, 1, 0};
  message.binning_x = at_least_zero(pixels.u.step);
  message.binning_y = at_least_zero(pixels.v.step);
  message.roi = {};
  message.roi.x_offset = first_pixel(pixels.u);
  message.roi.y_offset = first_pixel(pixels.v);
}

void to_message(const HeadInfo& head, wire::TFMessage& message) {
  message.transforms.clear();
  add_transform(head.head, fmt::format("{}_camera_optical", head.head), T_head_cam(), message);
  for (const auto& frame : head.frames) {
    add_transform(head.head, frame->frame_id, frame->T_head_scan, message);
  }
}

void to_message(const ScannerStatus& status, wire::DiagnosticArray& message) {
  message.status.resize(1);
  wire::DiagnosticStatus& one = message.status.front();
  one.level = level_of(status);
  one.name = fmt::format("{}: scanner", status.head);
  one.message = message_of(status, one.level);
  one.hardware_id = status.head;
  const AmbientStatus& ambient = status.ambient;
  const ScannerStatistics& counts = status.counts;
  one.values = {{"source", std::string(to_string(status.source))},
                {"pattern", ambient.pattern.to_string()},
                {"pattern_origin", std::string(to_string(ambient.origin))},
                {"tracking_phase", std::string(to_string(ambient.phase))},
                {"ambient_method", std::string(to_string(ambient.method))},
                {"channel", std::string(ambient.channel ? to_string(*ambient.channel) : "")},
                {"axis", std::string(to_string(status.axis))},
                {"frames", fmt::to_string(counts.frames)},
                {"scans", fmt::to_string(counts.scans)},
                {"without_stripe", fmt::to_string(counts.without_stripe)},
                {"dark", fmt::to_string(counts.dark)},
                {"unpaired", fmt::to_string(counts.unpaired)},
                {"refused", fmt::to_string(counts.refused)}};
}

}  // namespace striper
