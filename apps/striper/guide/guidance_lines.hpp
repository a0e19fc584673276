// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <striper/core/append_file.hpp>

#include "guide/guidance_output.hpp"

namespace striper::program {

/// Writes what guidance says as lines of JSON, at once: `{"table":"lateral",...}` with the names
/// and numbers of lateral.csv, guns.csv, seen.csv and faults.csv, `{"table":"switch",
/// "gun":NAME,"is_on":true,"time_s":T}` when a signal changes, and last `{"table":"safe",
/// "time_s":T,"volts":V}`: guns off, the safe voltage. As `AppendFile` in what is thrown.
class GuidanceLines final : public GuidanceOutput {
 public:
  /// @param path "-" is the standard output.
  GuidanceLines(const GuidanceConfig& config, const std::string& path);
  ~GuidanceLines() override;

  void lateral(const LateralLine& line) override;
  void switch_gun(std::size_t gun, bool is_on, double time_s) override;
  void gun(const GunLine& line) override;
  void seen(const SeenLine& line) override;
  void fault(const FaultLine& line) override;
  void switch_laser_off(double time_s) override;

  void finish() override;
  Account account() const override;

 private:
  AppendFile output_;
  std::vector<std::string> guns_;
  std::vector<char> is_on_;
  double volts_safe_;
  double now_s_ = 0.0;  // Of the last that was said.
  std::uint64_t written_ = 0;
};

}  // namespace striper::program
