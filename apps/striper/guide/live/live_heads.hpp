// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/guidance/guidance_config.hpp>
#include <striper/stream/head.hpp>
#include <striper/stream/scan_bus.hpp>

#include "guide/live/input_merge.hpp"
#include "guide/live/odometer_port.hpp"
#include "serve/scanner_settings.hpp"

namespace striper::program {

/// A head: of the command line, `NAME=SOURCE` and `NAME=MODEL`, or of a rig.
struct LiveHead {
  std::string name;
  std::string source;
  std::string model;
  /// Of its scanner, by the names of `scanner_options()`.
  std::map<std::string, std::string, std::less<>> options;
};

/// The heads whose scans are beams, and the odometer, on their way to guidance: each head on a
/// thread of its own, its scans through a bus, all of it in the order of time.
///
/// A camera that is not there, or goes away, is waited for and opened again.
class LiveHeads {
 public:
  /// @param record a directory that gets what a recorded run has: HEAD.mcap of each head; empty:
  /// not
  /// @throws Error where a beam's head is not among the heads, the odometer is none, a model is
  /// none
  LiveHeads(std::vector<LiveHead> heads, const GuidanceConfig& config,
            const std::filesystem::path& record, const EventPort& events);
  LiveHeads(const LiveHeads&) = delete;
  LiveHeads& operator=(const LiveHeads&) = delete;
  ~LiveHeads();

  void start();
  bool is_any_running() const;
  /// Whether time passes with the clock: a source that waits is never late.
  bool is_live() const noexcept { return is_live_; }
  InputMerge& inputs() noexcept { return inputs_; }

  /// Lasers off, now: by the cameras' control where they have one, else by closing them.
  void switch_lasers_off();
  /// Ends the heads, writes what is queued. @throws what a head threw that could not begin.
  void finish();

 private:
  struct Running;
  class BeamSink;
  void give_readings(std::size_t head, double until_s);
  void add(std::size_t index, const GuidanceConfig& config, const std::filesystem::path& record);

  std::vector<LiveHead> named_;
  EventPort events_;
  InputMerge inputs_;
  ScanBus bus_;
  std::vector<std::unique_ptr<Running>> heads_;
  std::unique_ptr<OdometerPort> odometer_;
  std::atomic<bool> is_live_ = false;
  bool is_finished_ = false;
};

}  // namespace striper::program
