// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <striper/core/append_file.hpp>
#include <striper/guidance/guidance.hpp>

namespace striper::program {

/// Writes what guidance says as lines of JSON, at once: `{"table":"lateral",...}` with the names
/// and numbers of lateral.csv, guns.csv, seen.csv and faults.csv, and `{"table":"switch",
/// "gun":NAME,"is_on":true,"time_s":T}` when a signal changes. As `AppendFile` in what is thrown.
class GuidanceLines : public GuidanceListener {
 public:
  /// @param path "-" is the standard output.
  GuidanceLines(const GuidanceConfig& config, const std::string& path);

  void lateral(const LateralLine& line) override;
  void switch_gun(std::size_t gun, bool is_on, double time_s) override;
  void gun(const GunLine& line) override;
  void seen(const SeenLine& line) override;
  void fault(const FaultLine& line) override;
  void switch_laser_off(double time_s) override;

  void close() { output_.close(); }

 private:
  AppendFile output_;
  std::vector<std::string> guns_;
};

}  // namespace striper::program
