// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace striper::detail::v4l2 {

/// What became ready while waiting.
struct Readiness {
  bool frame = false;   ///< A buffer can be taken.
  bool failed = false;  ///< The device reports an error or is gone.
  bool woken = false;   ///< Somebody wrote to the wake-up descriptor.
};

/// The system calls that drive a V4L2 device, and nothing else: the seam behind which tests put a
/// device of their own, to inject faults and to measure without a camera. Thread-safe.
class VideoCalls {
 public:
  VideoCalls() = default;
  VideoCalls(const VideoCalls&) = delete;
  VideoCalls& operator=(const VideoCalls&) = delete;
  virtual ~VideoCalls() = default;

  /// @return the descriptor, or the negative error number.
  virtual int open(const std::string& path) noexcept = 0;
  virtual void close(int fd) noexcept = 0;

  /// @return 0, or the error number. Repeats a call that a signal interrupted.
  virtual int control(int fd, unsigned long request, void* argument) noexcept = 0;

  /// @return the memory, or null.
  virtual std::uint8_t* map(int fd, std::size_t bytes, std::int64_t offset) noexcept = 0;
  virtual void unmap(std::uint8_t* memory, std::size_t bytes) noexcept = 0;

  /// Waits for a frame, an error or a write to `wake_fd`.
  virtual Readiness wait(int fd, int wake_fd, int timeout_ms) noexcept = 0;
};

/// The real ones.
std::shared_ptr<VideoCalls> system_video_calls();

}  // namespace striper::detail::v4l2
