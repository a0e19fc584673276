// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>

namespace striper::program {

/// Passes events on and holds them until somebody takes them. Thread-safe; copies share it.
class HeldEvents {
 public:
  explicit HeldEvents(EventPort onward);

  const EventPort& port() const noexcept { return port_; }
  std::vector<Event> take();

 private:
  struct Shared {
    std::mutex mutex;
    std::vector<Event> events;
  };
  std::shared_ptr<Shared> shared_;
  EventPort port_;
};

/// Where `striper record` puts frames. Not thread-safe.
class FrameKeeper {
 public:
  FrameKeeper() = default;
  FrameKeeper(const FrameKeeper&) = delete;
  FrameKeeper& operator=(const FrameKeeper&) = delete;
  virtual ~FrameKeeper() = default;

  /// @throws Error{kIo}; what was written before stays readable.
  virtual void write(const Frame& frame) = 0;
  virtual void finish() {}

  virtual std::uint64_t frames() const = 0;
  virtual std::uint64_t scans() const { return 0; }
  /// What `striper capture` replays it by.
  virtual std::string address() const = 0;
};

/// Whether frames go into one file, FILE.mcap or mcap:FILE, and not into a directory.
bool is_recording_file(const std::string& output);

/// @param model its path, of the scans that a file gets beside the frames.
/// @throws Error{kUsage} where there is something already, or a directory is to hold scans; as
/// `scanner_setup`.
std::unique_ptr<FrameKeeper> make_frame_keeper(const std::string& output,
                                               const std::optional<std::string>& model,
                                               const SourceInfo& source, const HeldEvents& events);

}  // namespace striper::program
