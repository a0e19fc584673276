// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <linux/videodev2.h>

#include "v4l2/device/video_calls.hpp"

namespace striper::testing {

/// A V4L2 device in this process: behaves as the kernel's API says (buffers, ownership, formats,
/// inputs, standards, controls), and fails on demand.
class FakeCamera final : public detail::v4l2::VideoCalls {
 public:
  struct Setup {
    std::uint32_t code = V4L2_PIX_FMT_GREY;
    std::vector<std::uint32_t> other_codes;
    int width = 64;
    int height = 48;  ///< Of the whole image.
    std::uint32_t field = V4L2_FIELD_NONE;
    v4l2_std_id standard = 0;  ///< What the signal is; 0: not a television input.
    std::size_t padding = 0;   ///< Bytes at the end of each row.
    bool is_multiplanar = false;
    bool stamps_start_of_exposure = false;
    bool stamps_are_monotonic = true;
    bool counts_fields = false;  ///< A driver that numbers fields where the kernel wants frames.
  };

  FakeCamera() : FakeCamera(Setup{}) {}
  explicit FakeCamera(const Setup& setup) : setup_(setup) {}
  ~FakeCamera() override { stop_running(); }

  // What a test does to it. All thread-safe.

  /// Exposes a frame (a field, where a buffer is one) whose pixels are the low byte of its count.
  void expose(std::uint32_t extra_flags = 0, std::size_t bytes_missing = 0);
  /// Exposes by itself from now on.
  void run(std::chrono::microseconds period);
  void stop_running();

  void unplug();
  void plug_in();
  void fail_next(unsigned long request, int error, int times = 1);
  /// The next answers to a request take so long.
  void delay_next(unsigned long request, std::chrono::milliseconds by, int times = 1);
  void fail_open(int error) { open_error_ = error; }
  /// Every wait reports an error until the device is opened again.
  void break_stream();
  void set_input_status(std::uint32_t status) { input_status_ = status; }
  void set_capabilities(std::uint32_t capabilities) { capabilities_ = capabilities; }
  void skip_sequence(std::uint32_t by);
  void set_next_time_ns(std::int64_t time_ns) { next_time_ns_ = time_ns; }
  void set_pixels(
      std::function<void(std::uint8_t* data, std::size_t bytes, std::uint64_t count)> fill) {
    fill_ = std::move(fill);
  }
  void add_control(std::uint32_t id, const std::string& name, std::uint32_t type,
                   std::int32_t minimum, std::int32_t maximum, std::int32_t value);
  std::int32_t control_value(std::uint32_t id) const;

  int opened() const { return opened_; }
  int mapped() const { return mapped_; }
  int queued() const;
  /// Nothing is left open or mapped.
  bool is_clean() const { return open_fds_ == 0 && mapped_ == 0; }

  // detail::v4l2::VideoCalls.
  int open(const std::string& path) noexcept override;
  void close(int fd) noexcept override;
  int control(int fd, unsigned long request, void* argument) noexcept override;
  std::uint8_t* map(int fd, std::size_t bytes, std::int64_t offset) noexcept override;
  void unmap(std::uint8_t* memory, std::size_t bytes) noexcept override;
  detail::v4l2::Readiness wait(int fd, int wake_fd, int timeout_ms) noexcept override;

 private:
  struct Buffer {
    std::uint8_t* memory = nullptr;
    std::uint32_t sequence = 0;
    std::uint32_t flags = 0;
    std::uint32_t field = 0;
    std::int64_t time_ns = 0;
    std::size_t bytes = 0;
  };
  struct OneControl {
    std::string name;
    std::uint32_t type;
    std::int32_t minimum, maximum, value;
  };

  int dispatch(int fd, unsigned long request, void* argument);
  int query_capability(v4l2_capability& capability) const;
  int enumerate_format(v4l2_fmtdesc& description) const;
  int set_format(int fd, v4l2_format& format);
  void write_format(v4l2_format& format) const;
  int request_buffers(int fd, v4l2_requestbuffers& request);
  int query_buffer(v4l2_buffer& buffer) const;
  int queue_buffer(int fd, const v4l2_buffer& buffer);
  int take_buffer(int fd, v4l2_buffer& buffer);
  int stream(int fd, bool on);
  int enumerate_input(v4l2_input& input) const;
  int query_control(v4l2_query_ext_ctrl& query) const;
  int access_control(v4l2_ext_controls& controls, bool is_set);
  bool knows(std::uint32_t code) const;
  std::size_t stride() const;
  std::size_t buffer_bytes() const;
  int buffer_rows() const;
  void drain_events() const;

  Setup setup_;
  mutable std::mutex mutex_;
  bool is_plugged_in_ = true;
  bool is_broken_ = false;
  std::set<int> descriptors_;
  int owner_ = -1;  ///< The descriptor that holds the buffers.
  bool is_streaming_ = false;
  std::vector<Buffer> buffers_;
  std::deque<std::uint32_t> queued_;
  std::deque<std::uint32_t> filled_;
  std::uint64_t count_ = 0;
  std::map<unsigned long, std::pair<int, int>> failures_;
  std::map<unsigned long, std::pair<std::chrono::milliseconds, int>> delays_;
  std::map<std::uint32_t, OneControl> controls_;
  std::function<void(std::uint8_t*, std::size_t, std::uint64_t)> fill_;
  std::map<std::uint8_t*, std::unique_ptr<std::uint8_t[]>> memory_;

  std::atomic<int> opened_{0};
  std::atomic<int> open_fds_{0};
  std::atomic<int> mapped_{0};
  std::atomic<int> open_error_{0};
  std::atomic<std::uint32_t> input_status_{0};
  std::atomic<std::uint32_t> capabilities_{0};
  std::atomic<std::int64_t> next_time_ns_{0};
  std::atomic<bool> is_running_{false};
  std::thread runner_;
};

}  // namespace striper::testing
