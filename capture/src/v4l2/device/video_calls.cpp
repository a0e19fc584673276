// SPDX-License-Identifier: Apache-2.0
#include "v4l2/device/video_calls.hpp"

#include <array>
#include <cerrno>

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace striper::detail::v4l2 {
namespace {

class SystemVideoCalls final : public VideoCalls {
 public:
  int open(const std::string& path) noexcept override {
    const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return fd >= 0 ? fd : -errno;
  }

  void close(int fd) noexcept override { ::close(fd); }

  int control(int fd, unsigned long request, void* argument) noexcept override {
    while (::ioctl(fd, request, argument) != 0) {
      if (errno != EINTR) return errno;
    }
    return 0;
  }

  std::uint8_t* map(int fd, std::size_t bytes, std::int64_t offset) noexcept override {
    // Written to as well where a driver insists on it; striper itself only reads.
    void* const memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
    return memory == MAP_FAILED ? nullptr : static_cast<std::uint8_t*>(memory);
  }

  void unmap(std::uint8_t* memory, std::size_t bytes) noexcept override { ::munmap(memory, bytes); }

  Readiness wait(int fd, int wake_fd, int timeout_ms) noexcept override {
    std::array<pollfd, 2> waiting{pollfd{fd, POLLIN, 0}, pollfd{wake_fd, POLLIN, 0}};
    if (::poll(waiting.data(), waiting.size(), timeout_ms) <= 0) return {};
    return {(waiting[0].revents & POLLIN) != 0,
            (waiting[0].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0,
            (waiting[1].revents & POLLIN) != 0};
  }
};

}  // namespace

std::shared_ptr<VideoCalls> system_video_calls() { return std::make_shared<SystemVideoCalls>(); }

}  // namespace striper::detail::v4l2
