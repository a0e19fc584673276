// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include <striper/core/controls.hpp>
#include <striper/simulator/simulator.hpp>

namespace striper::detail {

/// The controls of a simulated striper. What is set waits here until the source takes it, between
/// two frames. Thread-safe.
class SimulatedControls {
 public:
  /// @param source for messages.
  SimulatedControls(const std::string& source, const Scene& scene);
  SimulatedControls(const SimulatedControls&) = delete;
  SimulatedControls& operator=(const SimulatedControls&) = delete;

  Controls& controls() noexcept { return controls_; }

  /// Has the simulator show what was set since the last call. By the thread that renders.
  void apply_to(Simulator& simulator);

 private:
  ControlRow exposure_row(double longest_s);
  ControlRow gain_row(double dn_per_electron);
  ControlRow laser_row();
  ControlRow pose_row(std::size_t object, const std::string& name);
  std::vector<ControlRow> rows(const Scene& scene);
  template <typename Read>
  std::function<ControlState()> locked(Read read);
  template <typename Write>
  std::function<void(const ControlValue&)> locked_write(Write write);

  std::mutex mutex_;
  SceneSettings wanted_;
  bool has_changed_ = false;
  Controls controls_;
};

}  // namespace striper::detail
