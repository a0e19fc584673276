// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <linux/videodev2.h>

#include "v4l2/device/video_device.hpp"
#include "v4l2/format/agreement.hpp"

namespace striper::detail::v4l2 {

/// A filled buffer, as the driver handed it over.
struct FilledBuffer {
  std::uint32_t index = 0;
  std::uint32_t flags = 0;
  std::uint32_t field = 0;
  std::uint32_t sequence = 0;
  std::int64_t time_ns = 0;
  std::size_t offset = 0;  ///< Where the image begins in the buffer.
  std::size_t bytes = 0;   ///< How much of it the driver filled.
};

/// The driver's buffers, mapped into our memory, and their way to the reader and back.
///
/// A buffer that was taken is either given back at once or lent out: the lease gives it back when
/// its last copy goes. Leases outlive the stream and the device: the memory stays mapped until the
/// last one is gone. Lending allocates nothing.
///
/// Threads: any thread may give back or drop a lease; the rest belongs to the capture thread.
class BufferRing : public std::enable_shared_from_this<BufferRing> {
 public:
  /// Asks the driver for buffers, maps and queues them.
  /// @throws Error{kDevice} where it refuses: another program streams, no memory.
  static std::shared_ptr<BufferRing> create(const VideoDevice& device, const Agreement& agreement,
                                            int count);
  ~BufferRing();
  BufferRing(const BufferRing&) = delete;
  BufferRing& operator=(const BufferRing&) = delete;

  void start_streaming(const VideoDevice& device);

  /// Takes the next filled buffer. @return 0, EAGAIN where none is ready, or the error number.
  int take(FilledBuffer& filled) noexcept;

  /// Hands a buffer back to the driver.
  void give_back(std::uint32_t index) noexcept;

  /// Tries once more to hand back those that the driver refused.
  void retry_refused() noexcept;

  /// Stops streaming and lets go of the device; leases stay valid.
  void detach() noexcept;

  /// Keeps the buffer from the driver until the last copy of the lease goes.
  std::shared_ptr<const void> lend(std::uint32_t index);

  const std::uint8_t* data(std::uint32_t index) const noexcept { return slots_[index].memory; }
  std::size_t size(std::uint32_t index) const noexcept { return slots_[index].bytes; }

  /// How many buffers the driver has to fill at the moment.
  int with_driver() const noexcept;
  int count() const noexcept { return static_cast<int>(slots_.size()); }

 private:
  struct Slot {
    std::uint8_t* memory = nullptr;
    std::size_t bytes = 0;
    bool is_refused = false;
    alignas(std::max_align_t) std::array<std::byte, 128> lease_block;  ///< A lease's bookkeeping.
  };
  template <typename T>
  struct LeaseAllocator;

  BufferRing(const VideoDevice& device, const Agreement& agreement);
  void request(const VideoDevice& device, int count);
  void map_all(const VideoDevice& device, std::size_t needed_bytes);
  int queue(std::uint32_t index) noexcept;
  v4l2_buffer blank(std::array<v4l2_plane, VIDEO_MAX_PLANES>& planes) const noexcept;

  std::shared_ptr<VideoCalls> calls_;
  std::uint32_t type_ = 0;
  std::uint32_t planes_ = 1;
  std::vector<Slot> slots_;
  mutable std::mutex mutex_;  ///< Guards the members below.
  int fd_ = -1;               ///< -1 once detached.
  int with_driver_ = 0;
};

}  // namespace striper::detail::v4l2
