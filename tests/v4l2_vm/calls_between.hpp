// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "v4l2/device/video_calls.hpp"

namespace striper::testing {

/// Calls that are passed on as they are: what stands between the source and the kernel derives from
/// it.
class PassedCalls : public detail::v4l2::VideoCalls {
 public:
  explicit PassedCalls(std::shared_ptr<VideoCalls> kernel = detail::v4l2::system_video_calls())
      : kernel_(std::move(kernel)) {}

  int open(const std::string& path) noexcept override { return kernel_->open(path); }
  void close(int fd) noexcept override { kernel_->close(fd); }
  int control(int fd, unsigned long request, void* argument) noexcept override {
    return kernel_->control(fd, request, argument);
  }
  std::uint8_t* map(int fd, std::size_t bytes, std::int64_t offset) noexcept override {
    return kernel_->map(fd, bytes, offset);
  }
  void unmap(std::uint8_t* memory, std::size_t bytes) noexcept override {
    kernel_->unmap(memory, bytes);
  }
  detail::v4l2::Readiness wait(int fd, int wake_fd, int timeout_ms) noexcept override {
    return kernel_->wait(fd, wake_fd, timeout_ms);
  }

 private:
  std::shared_ptr<VideoCalls> kernel_;
};

/// Writes down what the kernel hands over: what the source's own counts are compared with.
class WatchedCalls final : public PassedCalls {
 public:
  struct Taken {
    std::uint32_t sequence = 0;
    std::uint32_t field = 0;
    bool is_flagged = false;
    int left_with_driver = 0;  ///< Buffers that the driver had besides, filled or not.
    std::int64_t time_ns = 0;  ///< The driver's stamp.
  };

  int control(int fd, unsigned long request, void* argument) noexcept override;

  /// Frames that the driver's numbers leave out. By its numbers alone, as plainly as can be: one
  /// that it gives twice, as the virtual driver does when it is late, subtracts nothing.
  static std::uint64_t lost_between(const Taken& one, const Taken& following) noexcept {
    const std::uint32_t step = following.sequence - one.sequence;
    return step > 0 ? step - 1 : 0;
  }

  /// Makes room for so many buffers: noting them allocates nothing then.
  void expect(std::size_t buffers) {
    taken_.reserve(buffers);
    queued_ns_.reserve(buffers);
  }

  /// Every buffer since the last start of a stream, in order.
  std::vector<Taken> taken() const;
  std::uint64_t lost() const;  ///< Since then, where a buffer is a frame.
  std::uint64_t flagged() const;

  /// Of the lost ones, those at whose beginning the driver had no empty buffer: by the times at
  /// which buffers were handed to it and at which it filled them, whenever somebody came to take
  /// them.
  std::uint64_t lost_for_want_of_a_buffer(std::int64_t frame_period_ns) const;
  int refused_buffers() const;  ///< That the driver would not have back.

 private:
  void note(unsigned long request, const void* argument, int error);

  mutable std::mutex mutex_;
  std::vector<Taken> taken_;
  std::vector<std::int64_t>
      queued_ns_;  ///< When each buffer was handed over, since they are there.
  int with_driver_ = 0;
  int refused_buffers_ = 0;
};

/// Calls one order of fields by the name of another on its way to the driver and back.
///
/// The kernel's virtual driver gives sequential fields, but not of what is sent to its output: it
/// refuses to loop them ("too much work", vivid_vid_can_loop). It passes an image on row by row,
/// though, so that one with its fields one after the other arrives as it was sent; only the label
/// has to be put right.
class RelabelledFields final : public PassedCalls {
 public:
  /// @param wanted what the source asks for and is told. @param real what the driver has.
  RelabelledFields(std::shared_ptr<VideoCalls> kernel, std::uint32_t wanted, std::uint32_t real)
      : PassedCalls(std::move(kernel)), wanted_(wanted), real_(real) {}

  int control(int fd, unsigned long request, void* argument) noexcept override;

 private:
  std::uint32_t wanted_;
  std::uint32_t real_;
};

}  // namespace striper::testing
