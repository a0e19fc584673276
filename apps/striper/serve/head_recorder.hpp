// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <striper/stream/scan_bus.hpp>
#include <striper/stream/sink_services.hpp>

namespace striper::program {

/// Recordings that begin and end while a head runs: frames and scans of so many seconds, each an
/// MCAP file of its own, HEAD-YYYYMMDDTHHMMSSZ.mcap. One at a time. Thread-safe.
class HeadRecorder {
 public:
  static constexpr double kLongest_s = 3600.0;

  /// @param folder made when the first recording begins; empty: there are none.
  HeadRecorder(std::filesystem::path folder, std::string head, ScanBus& bus, EventPort events);

  /// Begins one. @return its path. @throws Error{kBadValue} for a length that is not 0 to an hour,
  /// {kUnsupported} while another one goes on or without a folder, {kIo}.
  std::filesystem::path begin(double seconds);

  /// Ends one whose time is over (recording_made); to be called now and then.
  void look();

  /// Those in the folder, the newest first.
  std::vector<RecordingFile> list() const;

  /// Where one of them lies. @throws Error{kNotFound} for a name that is none of them.
  std::filesystem::path path_of(std::string_view name) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Going {
    std::filesystem::path path;
    std::string sink;
    Clock::time_point end;
  };

  const std::filesystem::path folder_;
  const std::string head_;
  ScanBus& bus_;
  const EventPort events_;
  std::mutex mutex_;
  std::optional<Going> going_;
};

}  // namespace striper::program
