// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string_view>
#include <vector>

#include <striper/can/can_port.hpp>

namespace striper {

/// A frame, and when it was on the bus, seconds since 1970.
struct HeardFrame {
  double time_s = 0.0;
  CanFrame frame;
};

/// Where frames come from: an interface of this machine, or a log that is played at its own pace.
/// Not thread-safe.
class CanListener {
 public:
  virtual ~CanListener() = default;

  /// The next frame. @return whether one came in that time. An interface that is down is heard
  /// again once it is up.
  virtual bool next(HeardFrame& heard, std::chrono::milliseconds timeout) = 0;
  /// A log is at its end: nothing comes any more.
  virtual bool is_over() const noexcept { return false; }
};

/// @param ids of the frames that are wanted; of more than 11 bits those of extended frames.
/// @throws Error{kUsage} for a key that nobody took, Error{kNotFound} naming interface or log,
/// Error{kUnsupported} where the kernel has no CAN or the log is no file (a pipe), Error{kBadFile}
/// naming a line that is none of a log, Error{kIo}.
std::unique_ptr<CanListener> open_can_listener(CanUri uri, const std::vector<std::uint32_t>& ids);

/// A line of a log of candump -L. @return whether it is one of a data frame; of remote and error
/// frames, and of frames of more than 8 bytes, it is not.
bool read_candump_line(std::string_view line, HeardFrame& heard) noexcept;

}  // namespace striper
