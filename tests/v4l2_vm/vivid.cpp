// SPDX-License-Identifier: Apache-2.0
#include "v4l2_vm/vivid.hpp"

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace striper::testing {
namespace {

constexpr std::uint32_t kOutput = V4L2_BUF_TYPE_VIDEO_OUTPUT;

// Enough to be late by 0.4 s: without a buffer to send the driver loops noise.
constexpr std::uint32_t kBuffers = 12;

void require(int error, const char* what) {
  if (error != 0)
    throw std::runtime_error(fmt::format("vivid: {}: {}", what, std::strerror(error)));
}

}  // namespace

Node::Node(const std::string& path) : fd_(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)) {}

Node::~Node() {
  if (fd_ >= 0) ::close(fd_);
}

int Node::call(unsigned long request, void* argument) const noexcept {
  return ::ioctl(fd_, request, argument) == 0 ? 0 : errno;
}

std::uint8_t* Node::map(std::size_t bytes, std::int64_t offset) const {
  void* const memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, offset);
  require(memory == MAP_FAILED ? errno : 0, "map a buffer");
  return static_cast<std::uint8_t*>(memory);
}

bool Node::is_vivid() const {
  v4l2_capability capability{};
  return fd_ >= 0 && call(VIDIOC_QUERYCAP, &capability) == 0 &&
         std::strcmp(reinterpret_cast<const char*>(capability.driver), "vivid") == 0;
}

void Node::set(VividControl control, int value) const {
  v4l2_control setting{static_cast<std::uint32_t>(control), value};
  require(call(VIDIOC_S_CTRL, &setting), fmt::format("control {:#x}", setting.id).c_str());
}

Transmitter::Transmitter(const std::string& path, const Broadcast& broadcast,
                         std::vector<std::vector<std::uint8_t>> frames)
    : node_(path),
      field_(broadcast.field),
      bottom_first_((broadcast.standard & V4L2_STD_525_60) != 0),
      frames_(std::move(frames)) {
  configure(broadcast);
  require(start(), "start sending");
  thread_ = std::thread([this] { run(); });
}

Transmitter::~Transmitter() {
  is_stopping_ = true;
  if (thread_.joinable()) thread_.join();
  int type = kOutput;
  node_.call(VIDIOC_STREAMOFF, &type);
  for (const Buffer& buffer : buffers_) ::munmap(buffer.memory, buffer_bytes_);
}

void Transmitter::configure(const Broadcast& broadcast) {
  v4l2_std_id standard = broadcast.standard;
  require(node_.call(VIDIOC_S_STD, &standard), "set the output's standard");
  const Node input(capture_path());
  input.set(VividControl::kLoopVideo, 1);
  constexpr int kNoText = 2;
  input.set(VividControl::kOsdText, kNoText);  // It is drawn over what arrives.
  v4l2_format format{};
  format.type = kOutput;
  v4l2_pix_format& pix = format.fmt.pix;
  pix.width = static_cast<std::uint32_t>(broadcast.width);
  pix.height = static_cast<std::uint32_t>(
      V4L2_FIELD_HAS_T_OR_B(broadcast.field) ? broadcast.height / 2 : broadcast.height);
  pix.pixelformat = broadcast.code;
  pix.field = broadcast.field;
  require(node_.call(VIDIOC_S_FMT, &format), "set the output's format");
  buffer_bytes_ = pix.sizeimage;
  stride_ = pix.bytesperline;
  v4l2_selection whole{};  // The last sender's cropping is still there.
  whole.type = kOutput;
  whole.target = V4L2_SEL_TGT_CROP;
  whole.r.width = pix.width;
  whole.r.height = pix.height;
  require(node_.call(VIDIOC_S_SELECTION, &whole), "send whole images");

  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = kOutput;
  request.memory = V4L2_MEMORY_MMAP;
  require(node_.call(VIDIOC_REQBUFS, &request), "get output buffers");
  for (std::uint32_t index = 0; index < request.count; ++index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = kOutput;
    buffer.memory = V4L2_MEMORY_MMAP;
    require(node_.call(VIDIOC_QUERYBUF, &buffer), "ask for an output buffer");
    buffers_.push_back({node_.map(buffer.length, buffer.m.offset)});
  }
}

void Transmitter::change(std::vector<std::vector<std::uint8_t>> frames) {
  const std::scoped_lock lock(mutex_);
  frames_.swap(frames);
  for (Buffer& buffer : buffers_) buffer.holds = nullptr;
}

int Transmitter::start() {
  next_ = 0;
  for (std::uint32_t index = 0; index < buffers_.size(); ++index) fill_and_queue(index);
  int type = kOutput;
  return node_.call(VIDIOC_STREAMON, &type);
}

void Transmitter::fill_and_queue(std::uint32_t index) {
  {
    const std::scoped_lock lock(mutex_);
    const std::vector<std::uint8_t>& frame = frames_[next_ % frames_.size()];
    if (buffers_[index].holds != frame.data())
      std::memcpy(buffers_[index].memory, frame.data(), std::min(frame.size(), buffer_bytes_));
    buffers_[index].holds = frame.data();
  }
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = kOutput;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.field = field_;
  buffer.bytesused = static_cast<std::uint32_t>(buffer_bytes_);
  if (field_ == V4L2_FIELD_ALTERNATE)
    buffer.field = (next_ % 2 == 0) == bottom_first_ ? V4L2_FIELD_BOTTOM : V4L2_FIELD_TOP;
  if (node_.call(VIDIOC_QBUF, &buffer) == 0) ++next_;
}

void Transmitter::run() {
  while (!is_stopping_) {
    v4l2_buffer buffer{};
    buffer.type = kOutput;
    buffer.memory = V4L2_MEMORY_MMAP;
    const int error = node_.call(VIDIOC_DQBUF, &buffer);
    if (error == 0) {
      fill_and_queue(buffer.index);
    } else if (error == EIO) {  // The driver's fatal error breaks every stream, this one, too.
      int type = kOutput;
      node_.call(VIDIOC_STREAMOFF, &type);
      began_anew_ns_ = std::chrono::steady_clock::now().time_since_epoch().count();
      start();
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
}

std::string capture_path() {
  const char* const path = std::getenv("STRIPER_VIDEO_DEVICE");
  return path != nullptr ? path : "/dev/video0";
}

std::string output_path() { return "/dev/video1"; }

}  // namespace striper::testing
