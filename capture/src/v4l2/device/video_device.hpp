// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <linux/videodev2.h>

#include <striper/core/error.hpp>

#include "v4l2/device/video_calls.hpp"

namespace striper::detail::v4l2 {

/// An open device node: its descriptor, its name for messages and what it says of itself.
class VideoDevice {
 public:
  /// Opens a node that can capture by streaming.
  /// @throws Error{kNotFound} no such node, Error{kDevice} busy, no permission, nothing behind the
  ///         node, or not a camera; each says what to do.
  VideoDevice(std::shared_ptr<VideoCalls> calls, std::string path);
  VideoDevice(const VideoDevice&) = delete;
  VideoDevice& operator=(const VideoDevice&) = delete;
  ~VideoDevice();

  const std::string& path() const noexcept { return path_; }
  const std::string& card() const noexcept { return card_; }
  const std::string& driver() const noexcept { return driver_; }
  const std::string& bus() const noexcept { return bus_; }
  bool is_multiplanar() const noexcept { return is_multiplanar_; }
  std::uint32_t buffer_type() const noexcept;
  int fd() const noexcept { return fd_; }
  const std::shared_ptr<VideoCalls>& calls() const noexcept { return calls_; }

  /// One control call. @return 0 or the error number.
  template <typename Argument>
  int attempt(unsigned long request, Argument& argument) const noexcept {
    return calls_->control(fd_, request, &argument);
  }

  /// The same, where refusal is an error: "v4l2 /dev/video0: cannot WHAT: REASON".
  template <typename Argument>
  void require(unsigned long request, Argument& argument, const std::string& what) const {
    if (const int error = attempt(request, argument); error != 0) refuse(what, error);
  }

  /// @throws Error of the kind that the error number stands for, with what to do about it.
  [[noreturn]] void refuse(const std::string& what, int error) const;

  /// @throws Error with this device's name before the message.
  [[noreturn]] void fail(ErrorKind kind, const std::string& message) const;

 private:
  void identify();

  std::shared_ptr<VideoCalls> calls_;
  std::string path_;
  int fd_ = -1;
  std::string card_;
  std::string driver_;
  std::string bus_;
  bool is_multiplanar_ = false;
};

/// Text from a fixed array of the kernel's, which need not end in a null.
template <typename Byte, std::size_t kSize>
std::string text_of(const Byte (&bytes)[kSize]) {
  std::string text;
  for (const Byte byte : bytes) {
    if (byte == 0) break;
    text += static_cast<char>(byte);
  }
  return text;
}

/// What an error number of a control call means here and what to do about it.
std::string advice(int error);

}  // namespace striper::detail::v4l2
