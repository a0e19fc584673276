// SPDX-License-Identifier: Apache-2.0
#include "v4l2/buffers/buffer_ring.hpp"

#include <cerrno>
#include <new>
#include <utility>

#include <fmt/format.h>

namespace striper::detail::v4l2 {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kMicrosecond_ns = 1'000;

}  // namespace

// Gives a lease's control block a place in its buffer's slot. It holds the ring, whose last owner
// it may be while the block is being released.
template <typename T>
struct BufferRing::LeaseAllocator {
  using value_type = T;  // NOLINT(readability-identifier-naming): the standard's name.

  LeaseAllocator(std::shared_ptr<BufferRing> owner, std::uint32_t place)
      : ring(std::move(owner)), index(place) {}
  template <typename U>
  LeaseAllocator(const LeaseAllocator<U>& other) : ring(other.ring), index(other.index) {}

  T* allocate(std::size_t count) {
    static_assert(sizeof(T) <= sizeof(Slot::lease_block) &&
                  alignof(T) <= alignof(std::max_align_t));
    if (count != 1) throw std::bad_alloc();
    return reinterpret_cast<T*>(ring->slots_[index].lease_block.data());
  }
  void deallocate(T*, std::size_t) noexcept {
    // Only now may the driver have the buffer again: its next lease uses the same place.
    ring->give_back(index);
  }
  template <typename U>
  bool operator==(const LeaseAllocator<U>& other) const noexcept {
    return ring == other.ring && index == other.index;
  }

  std::shared_ptr<BufferRing> ring;
  std::uint32_t index;
};

BufferRing::BufferRing(const VideoDevice& device, const Agreement& agreement)
    : calls_(device.calls()),
      type_(device.buffer_type()),
      planes_(static_cast<std::uint32_t>(agreement.planes)),
      fd_(device.fd()) {}

std::shared_ptr<BufferRing> BufferRing::create(const VideoDevice& device,
                                               const Agreement& agreement, int count) {
  std::shared_ptr<BufferRing> ring(new BufferRing(device, agreement));
  ring->request(device, count);
  ring->map_all(device, agreement.buffer_bytes());
  for (std::uint32_t index = 0; index < ring->slots_.size(); ++index) {
    if (const int error = ring->queue(index); error != 0) device.refuse("queue a buffer", error);
  }
  return ring;
}

BufferRing::~BufferRing() {
  detach();
  for (const Slot& slot : slots_) {
    if (slot.memory != nullptr) calls_->unmap(slot.memory, slot.bytes);
  }
}

void BufferRing::request(const VideoDevice& device, int count) {
  constexpr std::uint32_t kFewest = 2;
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(count);
  request.type = type_;
  request.memory = V4L2_MEMORY_MMAP;
  device.require(VIDIOC_REQBUFS, request, fmt::format("get {} buffers", count));
  if (request.count < kFewest)
    device.fail(ErrorKind::kDevice, fmt::format("the driver has only {} buffers", request.count));
  slots_ = std::vector<Slot>(request.count);
}

void BufferRing::map_all(const VideoDevice& device, std::size_t needed_bytes) {
  for (std::uint32_t index = 0; index < slots_.size(); ++index) {
    std::array<v4l2_plane, VIDEO_MAX_PLANES> planes{};
    v4l2_buffer buffer = blank(planes);
    buffer.index = index;
    device.require(VIDIOC_QUERYBUF, buffer, "ask where a buffer is");
    const bool is_multiplanar = type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
    const std::size_t bytes = is_multiplanar ? planes[0].length : buffer.length;
    const std::int64_t offset = is_multiplanar ? planes[0].m.mem_offset : buffer.m.offset;
    if (bytes < needed_bytes) {
      device.fail(ErrorKind::kDevice, fmt::format("its buffers are of {} bytes, an image needs {}",
                                                  bytes, needed_bytes));
    }
    slots_[index].memory = calls_->map(fd_, bytes, offset);
    slots_[index].bytes = bytes;
    if (slots_[index].memory == nullptr) device.refuse("map a buffer", ENOMEM);
  }
}

v4l2_buffer BufferRing::blank(std::array<v4l2_plane, VIDEO_MAX_PLANES>& planes) const noexcept {
  v4l2_buffer buffer{};
  buffer.type = type_;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE) {
    buffer.m.planes = planes.data();
    buffer.length = planes_;
  }
  return buffer;
}

void BufferRing::start_streaming(const VideoDevice& device) {
  int type = static_cast<int>(type_);
  device.require(VIDIOC_STREAMON, type, "start streaming");
}

int BufferRing::take(FilledBuffer& filled) noexcept {
  std::array<v4l2_plane, VIDEO_MAX_PLANES> planes{};
  v4l2_buffer buffer = blank(planes);
  if (const int error = calls_->control(fd_, VIDIOC_DQBUF, &buffer); error != 0) return error;
  const bool is_multiplanar = type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
  filled.index = buffer.index;
  filled.flags = buffer.flags;
  filled.field = buffer.field;
  filled.sequence = buffer.sequence;
  filled.time_ns =
      buffer.timestamp.tv_sec * kSecond_ns + buffer.timestamp.tv_usec * kMicrosecond_ns;
  filled.offset = is_multiplanar ? planes[0].data_offset : 0;
  filled.bytes = is_multiplanar ? planes[0].bytesused : buffer.bytesused;
  const std::scoped_lock lock(mutex_);
  --with_driver_;
  return 0;
}

int BufferRing::queue(std::uint32_t index) noexcept {
  std::array<v4l2_plane, VIDEO_MAX_PLANES> planes{};
  v4l2_buffer buffer = blank(planes);
  buffer.index = index;
  const int error = calls_->control(fd_, VIDIOC_QBUF, &buffer);
  if (error == 0) ++with_driver_;
  return error;
}

void BufferRing::give_back(std::uint32_t index) noexcept {
  const std::scoped_lock lock(mutex_);
  if (fd_ < 0) return;
  slots_[index].is_refused = queue(index) != 0;
}

void BufferRing::retry_refused() noexcept {
  const std::scoped_lock lock(mutex_);
  if (fd_ < 0) return;
  for (std::uint32_t index = 0; index < slots_.size(); ++index) {
    if (slots_[index].is_refused) slots_[index].is_refused = queue(index) != 0;
  }
}

void BufferRing::detach() noexcept {
  const std::scoped_lock lock(mutex_);
  if (fd_ < 0) return;
  int type = static_cast<int>(type_);
  calls_->control(fd_, VIDIOC_STREAMOFF, &type);
  // Lets other programs have the device; the kernel keeps mapped memory until it is unmapped.
  v4l2_requestbuffers none{};
  none.type = type_;
  none.memory = V4L2_MEMORY_MMAP;
  calls_->control(fd_, VIDIOC_REQBUFS, &none);
  fd_ = -1;
}

std::shared_ptr<const void> BufferRing::lend(std::uint32_t index) {
  return std::shared_ptr<const void>(
      static_cast<const void*>(data(index)), [](const void*) {},
      LeaseAllocator<std::byte>(shared_from_this(), index));
}

int BufferRing::with_driver() const noexcept {
  const std::scoped_lock lock(mutex_);
  return with_driver_;
}

}  // namespace striper::detail::v4l2
