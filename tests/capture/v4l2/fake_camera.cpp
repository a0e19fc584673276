// SPDX-License-Identifier: Apache-2.0
#include "capture/v4l2/fake_camera.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "v4l2/format/pixel_format.hpp"

namespace striper::testing {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

template <typename Byte, std::size_t kSize>
void copy_text(Byte (&to)[kSize], const std::string& text) {
  std::memset(to, 0, kSize);
  std::memcpy(to, text.data(), std::min(text.size(), kSize - 1));
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

std::size_t FakeCamera::stride() const {
  return detail::v4l2::find_pixel_format(setup_.code)->row_bytes(setup_.width) + setup_.padding;
}

int FakeCamera::buffer_rows() const {
  return V4L2_FIELD_HAS_T_OR_B(setup_.field) ? setup_.height / 2 : setup_.height;
}

std::size_t FakeCamera::buffer_bytes() const {
  const std::size_t bytes = stride() * static_cast<std::size_t>(buffer_rows());
  return bytes > 0 ? bytes : 65536;  // A JPEG's size is its own.
}

void FakeCamera::expose(std::uint32_t extra_flags, std::size_t bytes_missing) {
  const std::scoped_lock lock(mutex_);
  if (!is_streaming_ || !is_plugged_in_) return;
  const std::uint64_t count = count_++;
  if (queued_.empty()) return;  // As in the kernel: the count goes on and the frame is lost.
  const std::uint32_t index = queued_.front();
  queued_.pop_front();
  Buffer& buffer = buffers_[index];
  const bool alternates = setup_.field == V4L2_FIELD_ALTERNATE;
  const bool is_525 = (setup_.standard & V4L2_STD_525_60) != 0;
  buffer.sequence =
      static_cast<std::uint32_t>(alternates && !setup_.counts_fields ? count / 2 : count);
  buffer.field = setup_.field;
  if (alternates) {
    const bool is_first = count % 2 == 0;
    buffer.field = is_first == is_525 ? V4L2_FIELD_BOTTOM : V4L2_FIELD_TOP;
  }
  buffer.flags = extra_flags;
  if (setup_.stamps_are_monotonic) buffer.flags |= V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (setup_.stamps_start_of_exposure) buffer.flags |= V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  const std::int64_t given_ns = next_time_ns_.exchange(0);
  buffer.time_ns = given_ns != 0 ? given_ns : now_ns();
  buffer.bytes = buffer_bytes() - bytes_missing;
  if (fill_) {
    fill_(buffer.memory, buffer_bytes(), count);
  } else {
    std::memset(buffer.memory, static_cast<int>(count & 0xFF), buffer_bytes());
  }
  filled_.push_back(index);
  const std::uint64_t one = 1;
  for (const int fd : descriptors_)
    [[maybe_unused]] const auto written = ::write(fd, &one, sizeof one);
}

void FakeCamera::run(std::chrono::microseconds period) {
  is_running_ = true;
  runner_ = std::thread([this, period] {
    auto next = std::chrono::steady_clock::now();
    while (is_running_) {
      next += period;
      std::this_thread::sleep_until(next);
      expose();
    }
  });
}

void FakeCamera::stop_running() {
  is_running_ = false;
  if (runner_.joinable()) runner_.join();
}

void FakeCamera::unplug() {
  const std::scoped_lock lock(mutex_);
  is_plugged_in_ = false;
  is_streaming_ = false;
  owner_ = -1;
  queued_.clear();
  filled_.clear();
  count_ = 0;
  const std::uint64_t one = 1;
  for (const int fd : descriptors_)
    [[maybe_unused]] const auto written = ::write(fd, &one, sizeof one);
}

void FakeCamera::plug_in() {
  const std::scoped_lock lock(mutex_);
  is_plugged_in_ = true;
}

void FakeCamera::break_stream() {
  const std::scoped_lock lock(mutex_);
  is_broken_ = true;
  const std::uint64_t one = 1;
  for (const int fd : descriptors_)
    [[maybe_unused]] const auto written = ::write(fd, &one, sizeof one);
}

void FakeCamera::fail_next(unsigned long request, int error, int times) {
  const std::scoped_lock lock(mutex_);
  failures_[request] = {error, times};
}

void FakeCamera::delay_next(unsigned long request, std::chrono::milliseconds by, int times) {
  const std::scoped_lock lock(mutex_);
  delays_[request] = {by, times};
}

void FakeCamera::skip_sequence(std::uint32_t by) {
  const std::scoped_lock lock(mutex_);
  count_ += by;
}

void FakeCamera::add_control(std::uint32_t id, const std::string& name, std::uint32_t type,
                             std::int32_t minimum, std::int32_t maximum, std::int32_t value) {
  controls_[id] = {name, type, minimum, maximum, value};
}

std::int32_t FakeCamera::control_value(std::uint32_t id) const {
  const std::scoped_lock lock(mutex_);
  return controls_.at(id).value;
}

int FakeCamera::queued() const {
  const std::scoped_lock lock(mutex_);
  return static_cast<int>(queued_.size());
}

int FakeCamera::open(const std::string&) noexcept {
  const std::scoped_lock lock(mutex_);
  if (open_error_ != 0) return -open_error_;
  if (!is_plugged_in_) return -ENOENT;
  const int fd = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  descriptors_.insert(fd);
  is_broken_ = false;
  ++opened_;
  ++open_fds_;
  return fd;
}

void FakeCamera::close(int fd) noexcept {
  const std::scoped_lock lock(mutex_);
  if (owner_ == fd) {
    owner_ = -1;
    is_streaming_ = false;
    queued_.clear();
    filled_.clear();
  }
  descriptors_.erase(fd);
  --open_fds_;
  ::close(fd);
}

int FakeCamera::control(int fd, unsigned long request, void* argument) noexcept {
  const std::scoped_lock lock(mutex_);
  if (!is_plugged_in_ || !descriptors_.contains(fd)) return ENODEV;
  if (const auto delay = delays_.find(request);
      delay != delays_.end() && delay->second.second > 0) {
    --delay->second.second;
    std::this_thread::sleep_for(delay->second.first);
  }
  if (const auto failure = failures_.find(request);
      failure != failures_.end() && failure->second.second > 0) {
    --failure->second.second;
    return failure->second.first;
  }
  return dispatch(fd, request, argument);
}

int FakeCamera::dispatch(int fd, unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP:
      return query_capability(*static_cast<v4l2_capability*>(argument));
    case VIDIOC_ENUM_FMT:
      return enumerate_format(*static_cast<v4l2_fmtdesc*>(argument));
    case VIDIOC_G_FMT:
      write_format(*static_cast<v4l2_format*>(argument));
      return 0;
    case VIDIOC_S_FMT:
      return set_format(fd, *static_cast<v4l2_format*>(argument));
    case VIDIOC_REQBUFS:
      return request_buffers(fd, *static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF:
      return query_buffer(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_QBUF:
      return queue_buffer(fd, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_DQBUF:
      return take_buffer(fd, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      return stream(fd, true);
    case VIDIOC_STREAMOFF:
      return stream(fd, false);
    case VIDIOC_ENUMINPUT:
      return enumerate_input(*static_cast<v4l2_input*>(argument));
    case VIDIOC_G_INPUT:
      *static_cast<int*>(argument) = 0;
      return 0;
    case VIDIOC_S_INPUT:
      return *static_cast<int*>(argument) == 0 ? 0 : EINVAL;
    case VIDIOC_QUERYSTD:
    case VIDIOC_G_STD:
      if (setup_.standard == 0) return ENODATA;
      *static_cast<v4l2_std_id*>(argument) = setup_.standard;
      return 0;
    case VIDIOC_S_STD:
      return setup_.standard == 0 ? ENODATA : 0;
    case VIDIOC_QUERY_EXT_CTRL:
      return query_control(*static_cast<v4l2_query_ext_ctrl*>(argument));
    case VIDIOC_G_EXT_CTRLS:
      return access_control(*static_cast<v4l2_ext_controls*>(argument), false);
    case VIDIOC_S_EXT_CTRLS:
      return access_control(*static_cast<v4l2_ext_controls*>(argument), true);
    default:
      return ENOTTY;
  }
}

int FakeCamera::query_capability(v4l2_capability& capability) const {
  capability = {};
  copy_text(capability.driver, "fake");
  copy_text(capability.card, "Fake camera");
  copy_text(capability.bus_info, "test:0");
  const std::uint32_t capture =
      setup_.is_multiplanar ? V4L2_CAP_VIDEO_CAPTURE_MPLANE : V4L2_CAP_VIDEO_CAPTURE;
  capability.device_caps = capture | V4L2_CAP_STREAMING;
  if (capabilities_ != 0) capability.device_caps = capabilities_;
  capability.capabilities = capability.device_caps | V4L2_CAP_DEVICE_CAPS;
  return 0;
}

int FakeCamera::enumerate_format(v4l2_fmtdesc& description) const {
  if (description.index > setup_.other_codes.size()) return EINVAL;
  description.pixelformat =
      description.index == 0 ? setup_.code : setup_.other_codes[description.index - 1];
  return 0;
}

bool FakeCamera::knows(std::uint32_t code) const {
  return code == setup_.code || std::find(setup_.other_codes.begin(), setup_.other_codes.end(),
                                          code) != setup_.other_codes.end();
}

void FakeCamera::write_format(v4l2_format& format) const {
  if (setup_.is_multiplanar) {
    v4l2_pix_format_mplane& pix = format.fmt.pix_mp;
    pix.width = static_cast<std::uint32_t>(setup_.width);
    pix.height = static_cast<std::uint32_t>(buffer_rows());
    pix.pixelformat = setup_.code;
    pix.field = setup_.field;
    pix.num_planes = 1;
    pix.plane_fmt[0].bytesperline = static_cast<std::uint32_t>(stride());
    pix.plane_fmt[0].sizeimage = static_cast<std::uint32_t>(buffer_bytes());
    return;
  }
  v4l2_pix_format& pix = format.fmt.pix;
  pix.width = static_cast<std::uint32_t>(setup_.width);
  pix.height = static_cast<std::uint32_t>(buffer_rows());
  pix.pixelformat = setup_.code;
  pix.field = setup_.field;
  pix.bytesperline = static_cast<std::uint32_t>(stride());
  pix.sizeimage = static_cast<std::uint32_t>(buffer_bytes());
}

int FakeCamera::set_format(int fd, v4l2_format& format) {
  if (owner_ >= 0 && owner_ != fd) return EBUSY;
  const std::uint32_t code =
      setup_.is_multiplanar ? format.fmt.pix_mp.pixelformat : format.fmt.pix.pixelformat;
  if (knows(code) && code != setup_.code) {
    std::replace(setup_.other_codes.begin(), setup_.other_codes.end(), code, setup_.code);
    setup_.code = code;
  }
  write_format(format);
  return 0;
}

int FakeCamera::request_buffers(int fd, v4l2_requestbuffers& request) {
  if (owner_ >= 0 && owner_ != fd) return EBUSY;
  queued_.clear();
  filled_.clear();
  drain_events();
  buffers_ = std::vector<Buffer>(request.count);
  owner_ = request.count > 0 ? fd : -1;
  is_streaming_ = false;
  return 0;
}

int FakeCamera::query_buffer(v4l2_buffer& buffer) const {
  if (buffer.index >= buffers_.size()) return EINVAL;
  constexpr std::uint32_t kPage = 1U << 24;
  if (setup_.is_multiplanar) {
    buffer.m.planes[0].length = static_cast<std::uint32_t>(buffer_bytes());
    buffer.m.planes[0].m.mem_offset = buffer.index * kPage;
  } else {
    buffer.length = static_cast<std::uint32_t>(buffer_bytes());
    buffer.m.offset = buffer.index * kPage;
  }
  return 0;
}

int FakeCamera::queue_buffer(int fd, const v4l2_buffer& buffer) {
  if (owner_ != fd) return EBUSY;
  if (buffer.index >= buffers_.size()) return EINVAL;
  const bool is_there = std::find(queued_.begin(), queued_.end(), buffer.index) != queued_.end();
  if (is_there) return EINVAL;
  queued_.push_back(buffer.index);
  return 0;
}

int FakeCamera::take_buffer(int fd, v4l2_buffer& buffer) {
  if (owner_ != fd || !is_streaming_) return EINVAL;
  if (is_broken_) return EIO;
  if (filled_.empty()) return EAGAIN;
  std::uint64_t events = 0;
  if (filled_.size() == 1) [[maybe_unused]]
    const auto got = ::read(fd, &events, sizeof events);
  const std::uint32_t index = filled_.front();
  filled_.pop_front();
  const Buffer& from = buffers_[index];
  buffer.index = index;
  buffer.sequence = from.sequence;
  buffer.flags = from.flags;
  buffer.field = from.field;
  buffer.timestamp.tv_sec = from.time_ns / kSecond_ns;
  buffer.timestamp.tv_usec = from.time_ns % kSecond_ns / 1000;
  if (setup_.is_multiplanar) {
    buffer.m.planes[0].bytesused = static_cast<std::uint32_t>(from.bytes);
  } else {
    buffer.bytesused = static_cast<std::uint32_t>(from.bytes);
  }
  return 0;
}

int FakeCamera::stream(int fd, bool on) {
  if (owner_ != fd) return owner_ < 0 ? EINVAL : EBUSY;
  is_streaming_ = on;
  if (on) {
    count_ = 0;
  } else {
    queued_.clear();
    filled_.clear();
    drain_events();
  }
  return 0;
}

void FakeCamera::drain_events() const {
  std::uint64_t events = 0;
  for (const int fd : descriptors_)
    [[maybe_unused]] const auto got = ::read(fd, &events, sizeof events);
}

int FakeCamera::enumerate_input(v4l2_input& input) const {
  if (input.index > 0) return EINVAL;
  copy_text(input.name, setup_.standard == 0 ? "Camera 1" : "S-Video");
  input.type = V4L2_INPUT_TYPE_CAMERA;
  input.std = setup_.standard == 0 ? 0 : V4L2_STD_ALL;
  input.capabilities = setup_.standard == 0 ? 0 : V4L2_IN_CAP_STD;
  input.status = input_status_;
  return 0;
}

int FakeCamera::query_control(v4l2_query_ext_ctrl& query) const {
  const bool is_next = (query.id & V4L2_CTRL_FLAG_NEXT_CTRL) != 0;
  const std::uint32_t id = query.id & ~V4L2_CTRL_FLAG_NEXT_CTRL;
  const auto found = is_next ? controls_.upper_bound(id) : controls_.find(id);
  if (found == controls_.end()) return EINVAL;
  query.id = found->first;
  query.type = found->second.type;
  copy_text(query.name, found->second.name);
  query.minimum = found->second.minimum;
  query.maximum = found->second.maximum;
  query.step = 1;
  query.flags = 0;
  return 0;
}

int FakeCamera::access_control(v4l2_ext_controls& controls, bool is_set) {
  for (std::uint32_t index = 0; index < controls.count; ++index) {
    v4l2_ext_control& one = controls.controls[index];
    const auto found = controls_.find(one.id);
    if (found == controls_.end()) return EINVAL;
    if (is_set) {
      found->second.value = one.value;
    } else {
      one.value = found->second.value;
    }
  }
  return 0;
}

std::uint8_t* FakeCamera::map(int, std::size_t bytes, std::int64_t offset) noexcept {
  const std::scoped_lock lock(mutex_);
  const auto index = static_cast<std::size_t>(offset >> 24);
  auto memory = std::make_unique<std::uint8_t[]>(bytes);
  std::uint8_t* const start = memory.get();
  memory_[start] = std::move(memory);
  buffers_[index].memory = start;
  ++mapped_;
  return start;
}

void FakeCamera::unmap(std::uint8_t* memory, std::size_t) noexcept {
  const std::scoped_lock lock(mutex_);
  memory_.erase(memory);
  --mapped_;
}

detail::v4l2::Readiness FakeCamera::wait(int fd, int wake_fd, int timeout_ms) noexcept {
  std::array<pollfd, 2> waiting{pollfd{fd, POLLIN, 0}, pollfd{wake_fd, POLLIN, 0}};
  ::poll(waiting.data(), waiting.size(), timeout_ms);
  const std::scoped_lock lock(mutex_);
  const bool is_lost = fd >= 0 && (!is_plugged_in_ || is_broken_);
  return {!is_lost && (waiting[0].revents & POLLIN) != 0, is_lost,
          (waiting[1].revents & POLLIN) != 0};
}

}  // namespace striper::testing
