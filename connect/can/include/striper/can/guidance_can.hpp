// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include <striper/can/can_port.hpp>
#include <striper/can/guidance_frames.hpp>
#include <striper/guidance/guidance.hpp>

namespace striper {

/// Sends what guidance decides over CAN, at once: lateral position and way of each scan, guns when
/// they change and with each scan, faults when they begin.
///
/// A fault that stops sends the safe voltage without waiting for a scan, which may not come. At the
/// end, however it comes about, guns are off and the voltage is the safe one. A receiver must do
/// the same by itself when frames stop. No allocation. Not thread-safe.
class GuidanceCan : public GuidanceListener {
 public:
  /// @param port where frames go. @param first_id of the four. @throws Error{kBadValue} for more
  /// guns than fit.
  GuidanceCan(const GuidanceConfig& config, std::unique_ptr<CanPort> port,
              std::uint32_t first_id = GuidanceFrames::kFirstId);
  ~GuidanceCan() override;

  void lateral(const LateralLine& line) override;
  void switch_gun(std::size_t gun, bool is_on, double time_s) override;
  void fault(const FaultLine& line) override;
  void switch_laser_off(double time_s) override;

  /// Makes all safe and closes. @throws Error as the port's `close` does.
  void finish();

  const CanPort& port() const noexcept { return *port_; }

 private:
  void send(double time_s, const CanFrame& frame) noexcept;
  void send_guns(double time_s) noexcept;
  void make_safe() noexcept;

  double volts_safe_;
  std::unique_ptr<CanPort> port_;
  GuidanceFrames frames_;
  LateralLine last_;
  double now_s_ = 0.0;  // Of the run, when something was sent last.
  std::uint8_t guns_ = 0;
  bool is_laser_off_ = false;
  bool is_finished_ = false;
};

/// Opens one by its address: `can:can0?id=800`, `candump:run.log`; `id` is the first of the four
/// identifiers. @throws Error as `open_can_port` and `GuidanceCan` do.
std::unique_ptr<GuidanceCan> open_guidance_can(std::string_view uri, const GuidanceConfig& config);

}  // namespace striper
