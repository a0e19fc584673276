// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <striper/virtual_camera/virtual_camera.hpp>

namespace striper::detail {

/// What registers are called: a feature's name, for a command the one that this value executes.
struct RegisterNames {
  std::map<std::uint32_t, std::string> registers;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::string> commands;  // by address and value

  /// The name, or the address in hexadecimal digits where it has none.
  std::string of(std::uint32_t address, std::uint32_t value) const;
};

/// The last writes that a camera took. Not thread-safe.
class RegisterLog {
 public:
  explicit RegisterLog(RegisterNames names) : names_(std::move(names)) {}

  std::string name_of(std::uint32_t address, std::uint32_t value) const {
    return names_.of(address, value);
  }
  void note(std::uint64_t controller, std::uint32_t address, std::uint32_t value,
            bool is_laser_armed);
  std::vector<RegisterWrite> writes() const { return {writes_.begin(), writes_.end()}; }

 private:
  static constexpr std::size_t kMost = 16384;
  RegisterNames names_;
  std::deque<RegisterWrite> writes_;
};

}  // namespace striper::detail
