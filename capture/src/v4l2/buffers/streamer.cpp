// SPDX-License-Identifier: Apache-2.0
#include "v4l2/buffers/streamer.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <striper/core/event.hpp>

#include "live/host_clock.hpp"
#include "v4l2/device/names.hpp"
#include "v4l2/format/negotiate.hpp"
#include "v4l2/format/picture_format.hpp"

namespace striper::detail::v4l2 {
namespace {

using std::chrono::milliseconds;

constexpr Reopening::Pauses kPauses{milliseconds{20}, milliseconds{1000}};

// Frames are read as the first agreement has them: how the rows of a buffer lie belongs to it.
StreamKind kind_of(const Agreement& agreement) {
  StreamKind kind;
  kind.image_size = {agreement.width, agreement.buffer_height};
  kind.sensor_size = agreement.frame_size();
  kind.bit_depth = agreement.format->bit_depth;
  kind.channels = agreement.format->channels();
  kind.layout =
      fmt::format("{} {} {} {}", fourcc_to_string(agreement.format->fourcc), agreement.stride,
                  field_to_string(agreement.field), static_cast<int>(agreement.first_field()));
  kind.words = agreement.describe();
  return kind;
}

}  // namespace

int exposures_per_picture(const Agreement& agreement) noexcept {
  return V4L2_FIELD_HAS_BOTH(agreement.field) || agreement.field == V4L2_FIELD_ALTERNATE ? 2 : 1;
}

ExposureClock::Stream clock_stream(const Agreement& agreement, const V4l2Options& options) {
  ExposureClock::Stream stream;
  stream.frame_period_ns = agreement.frame_period_ns();
  stream.exposure_ns = agreement.exposure_ns;
  stream.offset_ns = std::llround(1e3 * options.time_offset_us);
  stream.exposures_per_picture = exposures_per_picture(agreement);
  stream.is_one_field_a_buffer = agreement.is_one_field_a_buffer();
  stream.first_field = agreement.first_field();
  if (options.fields) {
    stream.exposures_per_picture = 2;
    stream.first_field =
        *options.fields == Field::kInterlacedTopFirst ? Field::kTop : Field::kBottom;
  }
  return stream;
}

Streamer::Streamer(std::unique_ptr<VideoDevice> device, const V4l2Options& options,
                   const Agreement& agreement, FrameQueue& queue, FrameCounts& counts)
    : options_(options),
      agreement_(agreement),
      queue_(queue),
      counts_(counts),
      calls_(device->calls()),
      device_(std::move(device)),
      clock_(clock_stream(agreement, options)),
      reopening_(options.events, "v4l2 " + options.device, kind_of(agreement), kPauses,
                 options.reconnect_s) {
  connect();
  wake_fd_ = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (wake_fd_ < 0) device_->refuse("make a wake-up descriptor", errno);
  queue_.open();
  thread_ = std::thread([this] { run(); });
}

// Asks for buffers and starts the device that is open.
void Streamer::connect() {
  set_format(*device_, agreement_);
  auto ring = BufferRing::create(*device_, agreement_, options_.buffers);
  ring->start_streaming(*device_);
  ring_ = std::move(ring);
  last_frame_ = Clock::now();

  checks_signal_ = options_.require_signal && agreement_.signal.standard != 0;
  has_signal_ = true;
  signal_since_ns_ = 0;
  signal_answer_ = Clock::duration::max();
  constexpr int kTimes = 3;  // One answer alone is late where something else had the processor.
  for (int time = 0; checks_signal_ && time < kTimes; ++time) ask_for_signal();
}

std::unique_ptr<VideoDevice> Streamer::finish() {
  if (thread_.joinable()) {
    is_stopping_ = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(wake_fd_, &one, sizeof one);
    thread_.join();
    ::close(wake_fd_);
  }
  if (ring_) ring_->detach();
  ring_.reset();
  return std::move(device_);
}

void Streamer::run() {
  while (!is_stopping_) {
    if (ring_) {
      wait_for_frame();
    } else {
      try_again();
    }
  }
}

void Streamer::wait_for_frame() {
  const auto stall =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options_.stall_s));
  const auto left = std::chrono::ceil<milliseconds>(last_frame_ + stall - Clock::now()).count();
  const Readiness ready =
      calls_->wait(device_->fd(), wake_fd_, static_cast<int>(std::max<std::int64_t>(left, 0)));
  if (is_stopping_) return;
  if (ready.frame) {
    take_all();
  } else if (ready.failed) {
    lose("the device reports an error or is gone");
  } else if (Clock::now() - last_frame_ >= stall) {
    lose(fmt::format("no frame for {:.3g} s", options_.stall_s));
  }
}

void Streamer::take_all() {
  FilledBuffer filled;
  int error = 0;
  while ((error = ring_->take(filled)) == 0) {
    last_frame_ = Clock::now();
    accept(filled);
  }
  ring_->retry_refused();
  if (error != EAGAIN) lose(std::strerror(error));
}

void Streamer::accept(const FilledBuffer& filled) {
  BufferStamp stamp;
  stamp.sequence = filled.sequence;
  const bool is_monotonic =
      (filled.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  stamp.time_ns = is_monotonic ? filled.time_ns : monotonic_now_ns();
  stamp.is_start_of_exposure = is_monotonic && (filled.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) ==
                                                   V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  if (filled.field == V4L2_FIELD_TOP) stamp.field = Field::kTop;
  if (filled.field == V4L2_FIELD_BOTTOM) stamp.field = Field::kBottom;

  QueuedFrame frame;
  frame.buffer = filled;
  frame.field = stamp.field;
  frame.place = clock_.place(stamp);
  counts_.drop(frame.place.lost_frames);
  judge(filled, frame);
  if (frame.status == FrameStatus::kOk) {
    frame.ring = ring_;
  } else {
    ring_->give_back(filled.index);
  }
  if (queue_.push(std::move(frame))) counts_.overrun(1);
}

void Streamer::judge(const FilledBuffer& filled, QueuedFrame& frame) {
  const std::size_t needed = agreement_.buffer_bytes();
  const auto refuse = [&](FrameStatus status, const char* detail) {
    frame.status = status;
    frame.detail = detail;
  };
  check_signal();
  // What was exposed before the signal was seen to be back is noise, or a part of it is.
  const bool has_signal = has_signal_ && frame.place.began_ns >= signal_since_ns_;
  if ((filled.flags & V4L2_BUF_FLAG_ERROR) != 0) {
    refuse(FrameStatus::kCorrupt, "the driver flagged the frame as damaged");
  } else if (!has_signal) {
    refuse(FrameStatus::kCorrupt, "the input had no signal");
  } else if (filled.bytes > 0 && filled.bytes < filled.offset + needed) {
    refuse(FrameStatus::kIncomplete, "the driver filled only a part of the image");
  } else if (filled.offset + needed > ring_->size(filled.index)) {
    refuse(FrameStatus::kCorrupt, "the driver put the image outside its buffer");
  }
}

// Asks for the signal after the frame was exposed: a loss is seen with the first frame that it
// spoils. A grabber that takes a good part of a field's time to answer is asked now and then.
void Streamer::check_signal() {
  constexpr milliseconds kNowAndThen{100};
  const bool is_quick = signal_answer_ < std::chrono::nanoseconds(clock_.exposure_period_ns() / 4);
  const bool is_due = is_quick || Clock::now() - signal_asked_at_ >= kNowAndThen;
  if (checks_signal_ && is_due) ask_for_signal();
}

void Streamer::ask_for_signal() {
  signal_asked_at_ = Clock::now();
  v4l2_input input{};
  input.index = static_cast<std::uint32_t>(agreement_.signal.input);
  if (device_->attempt(VIDIOC_ENUMINPUT, input) != 0) return;
  signal_answer_ = std::min(signal_answer_, Clock::now() - signal_asked_at_);
  const std::string trouble = signal_trouble(input.status);
  if (!trouble.empty() && has_signal_) {
    options_.events.send({"signal_lost", fmt::format("v4l2 {}: input {} ('{}') {}", options_.device,
                                                     agreement_.signal.input,
                                                     agreement_.signal.input_name, trouble)});
  }
  if (trouble.empty() && !has_signal_) signal_since_ns_ = monotonic_now_ns();
  has_signal_ = trouble.empty();
}

void Streamer::lose(const std::string& reason) {
  ring_->detach();
  ring_.reset();
  device_.reset();
  clock_.interrupt();
  if (!reopening_.lose(reason)) end();
}

void Streamer::try_again() {
  calls_->wait(-1, wake_fd_, has_ended_ ? -1 : static_cast<int>(reopening_.pause().count()));
  if (is_stopping_ || has_ended_) return;
  const Reopening::Outcome outcome = reopening_.attempt([this] { open_again(); });
  if (outcome == Reopening::Outcome::kBack) return;
  ring_.reset();
  device_.reset();
  if (outcome == Reopening::Outcome::kGone) end();
}

void Streamer::open_again() {
  device_ = std::make_unique<VideoDevice>(calls_, options_.device);
  reopening_.require_same(kind_of(negotiate(*device_, options_)));
  connect();
  counts_.reconnect();
}

void Streamer::end() {
  has_ended_ = true;
  queue_.close(NextStatus::kEnd);
}

}  // namespace striper::detail::v4l2
