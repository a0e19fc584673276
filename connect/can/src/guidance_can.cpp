// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <exception>
#include <limits>

#include <fmt/format.h>

#include <striper/can/guidance_can.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr long kLargestId = 0x7FF;

}  // namespace

GuidanceCan::GuidanceCan(const GuidanceConfig& config, std::unique_ptr<CanPort> port,
                         std::uint32_t first_id)
    : volts_safe_(config.output.volts_safe), port_(std::move(port)), frames_(first_id) {
  if (config.guns.size() > GuidanceFrames::kMostGuns) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("guidance.yaml has {} guns - expected at most {}, the bits of a frame",
                            config.guns.size(), GuidanceFrames::kMostGuns));
  }
  last_.volts = volts_safe_;
}

GuidanceCan::~GuidanceCan() {
  if (is_finished_) return;
  make_safe();
  try {
    port_->close();
  } catch (const std::exception&) {
    // What broke the run off is told; this would hide it.
  }
}

void GuidanceCan::lateral(const LateralLine& line) {
  last_ = line;
  send(line.time_s, frames_.lateral(line));
  send(line.time_s, frames_.way(line));
  send_guns(line.time_s);
}

void GuidanceCan::switch_gun(std::size_t gun, bool is_on, double time_s) {
  const auto bit = static_cast<std::uint8_t>(1U << gun);
  guns_ = static_cast<std::uint8_t>(is_on ? guns_ | bit : guns_ & ~bit);
  send_guns(time_s);
}

void GuidanceCan::fault(const FaultLine& line) {
  send(line.time_s, frames_.fault(line));
  if (line.action == FaultAction::kWarn) return;
  last_.state = PathState::kFault;
  if (line.action == FaultAction::kStop) last_.volts = volts_safe_;
  send(line.time_s, frames_.lateral(last_));
}

void GuidanceCan::switch_laser_off(double time_s) {
  is_laser_off_ = true;
  send_guns(time_s);
}

void GuidanceCan::send(double time_s, const CanFrame& frame) noexcept {
  now_s_ = time_s;
  port_->send(time_s, frame);
}

void GuidanceCan::send_guns(double time_s) noexcept {
  send(time_s, frames_.guns(guns_, is_laser_off_));
}

void GuidanceCan::make_safe() noexcept {
  guns_ = 0;
  last_.lateral_m = last_.sigma_m = kUnknown;
  last_.volts = volts_safe_;
  last_.beams = 0;
  last_.state = PathState::kLost;
  send_guns(now_s_);
  send(now_s_, frames_.lateral(last_));
}

void GuidanceCan::finish() {
  if (!is_finished_) make_safe();
  is_finished_ = true;
  port_->close();
}

std::unique_ptr<GuidanceCan> open_guidance_can(std::string_view uri, const GuidanceConfig& config) {
  CanUri parsed = CanUri::parse(uri);
  const auto id = parsed.take_integer("id", 0, kLargestId - GuidanceFrames::kIds + 1);
  const auto first_id = id ? static_cast<std::uint32_t>(*id) : GuidanceFrames::kFirstId;
  return std::make_unique<GuidanceCan>(config, open_can_port(std::move(parsed)), first_id);
}

}  // namespace striper
