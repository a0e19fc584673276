// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>
#include <striper/core/frame.hpp>
#include <striper/v4l2/v4l2_source.hpp>

#include "capture/common_keys.hpp"
#include "capture/frame_counts.hpp"
#include "live/host_clock.hpp"
#include "v4l2/buffers/picture_queue.hpp"
#include "v4l2/buffers/streamer.hpp"
#include "v4l2/device/names.hpp"
#include "v4l2/format/negotiate.hpp"
#include "v4l2/source_controls.hpp"
#include "v4l2/v4l2_stream.hpp"

namespace striper::detail::v4l2 {
namespace {

// The frame that is given to the reader: at once, or its two fields one after the other.
struct CurrentFrame {
  QueuedFrame queued;
  std::shared_ptr<const void> lease;
  int next_part = 0;
  int parts = 0;

  bool is_done() const { return next_part == parts; }
};

class V4l2Source final : public FrameSource {
 public:
  V4l2Source(V4l2Options options, std::shared_ptr<VideoCalls> calls);
  ~V4l2Source() override { V4l2Source::stop(); }

  SourceInfo info() const override;
  void start() override;
  NextStatus next(Frame& frame, std::chrono::milliseconds timeout) override;
  void stop() override;
  SourceStatistics statistics() const override { return counts_.now(); }
  Controls& controls() override { return controls_; }

 private:
  void take_current();
  void fill(Frame& frame);
  void fill_place(Frame& frame, int part) const;
  void fill_image(Frame& frame, int part);
  RawImage raw_part(int part) const;
  Field field_of(int part) const;

  V4l2Options options_;
  CommonKeys keys_;
  std::shared_ptr<VideoCalls> calls_;
  std::unique_ptr<VideoDevice> device_;  ///< The streamer's while it streams.
  std::string card_;
  Agreement agreement_;
  std::atomic<std::int64_t> exposure_ns_ = 0;  ///< Of the device now.
  Controls controls_;

  FrameCounts counts_;
  FrameQueue queue_;
  CurrentFrame current_;  ///< Of the thread that calls `next`.
  std::mutex control_;    ///< Guards starting and stopping.
  std::unique_ptr<Streamer> streamer_;
};

V4l2Source::V4l2Source(V4l2Options options, std::shared_ptr<VideoCalls> calls)
    : options_(std::move(options)), calls_(std::move(calls)), queue_(options_.queue) {
  options_.validate();
  keys_.pattern = options_.pattern;
  keys_.fields = options_.fields;
  device_ = std::make_unique<VideoDevice>(calls_, options_.device);
  agreement_ = negotiate(*device_, options_);
  exposure_ns_ = agreement_.exposure_ns;
  controls_ = make_controls(*device_, agreement_.frame_size(),
                            [this](std::int64_t exposure_ns) { exposure_ns_ = exposure_ns; });
  card_ = fmt::format("{} ({}, {})", device_->card(), device_->driver(), device_->bus());
  if (options_.fields && agreement_.is_sequential()) {
    device_->fail(
        ErrorKind::kUsage,
        fmt::format("fields= contradicts field={}, which says itself which field is first",
                    field_to_string(agreement_.field)));
  }
  options_.events.send({"source_opened", fmt::format("v4l2 {}: {}, {}", options_.device, card_,
                                                     agreement_.describe())});
}

SourceInfo V4l2Source::info() const {
  SourceInfo info;
  info.uri = options_.uri.empty() ? "v4l2:" + options_.device : options_.uri;
  info.description = fmt::format("{}, {}", card_, agreement_.describe());
  info.sensor_size = agreement_.frame_size();
  info.image_size = info.sensor_size;
  info.bit_depth = agreement_.format->bit_depth;
  info.channels = agreement_.format->channels();
  info.is_live = true;
  info.has_clock = true;
  info.picture_rate_hz = agreement_.picture_rate_hz;
  if (agreement_.is_interlaced()) {
    info.field = agreement_.first_field() == Field::kTop ? Field::kInterlacedTopFirst
                                                         : Field::kInterlacedBottomFirst;
  }
  if (agreement_.is_sequential() || agreement_.is_one_field_a_buffer()) {
    info.image_size.height /= 2;
    info.field = agreement_.field == V4L2_FIELD_BOTTOM ? Field::kBottom : Field::kTop;
    info.pattern = keys_.pattern;
    return info;
  }
  keys_.apply(info);
  return info;
}

void V4l2Source::start() {
  const std::scoped_lock lock(control_);
  if (streamer_) return;
  if (!device_) {
    device_ = std::make_unique<VideoDevice>(calls_, options_.device);
    agreement_ = negotiate(*device_, options_);
    exposure_ns_ = agreement_.exposure_ns;
  }
  counts_.reset();
  current_ = {};
  // A device that refuses to stream is closed, so that the next attempt begins afresh.
  streamer_ = std::make_unique<Streamer>(std::move(device_), options_, agreement_, queue_, counts_);
}

void V4l2Source::stop() {
  const std::scoped_lock lock(control_);
  if (!streamer_) return;
  queue_.close(NextStatus::kStopped);
  device_ = streamer_->finish();
  streamer_.reset();
  queue_.close(NextStatus::kStopped);  // Whatever came in between.
}

NextStatus V4l2Source::next(Frame& frame, std::chrono::milliseconds timeout) {
  // Memory of the driver's goes back before anything else; memory of our own is used again.
  if (!is_sole_owner(frame.image)) frame.image.release();
  frame.lease.reset();
  if (!current_.is_done() && queue_.is_stopped()) current_ = {};
  if (current_.is_done()) {
    const NextStatus status = queue_.pop(current_.queued, timeout);
    if (status != NextStatus::kFrame) return status;
    take_current();
  }
  fill(frame);
  counts_.deliver(frame);
  return NextStatus::kFrame;
}

void V4l2Source::take_current() {
  QueuedFrame& queued = current_.queued;
  const bool is_usable = queued.status == FrameStatus::kOk;
  current_.next_part = 0;
  current_.parts = is_usable && agreement_.is_sequential() ? 2 : 1;
  if (is_usable) current_.lease = queued.ring->lend(queued.buffer.index);
}

void V4l2Source::fill(Frame& frame) {
  const int part = current_.next_part++;
  const QueuedFrame& queued = current_.queued;
  frame.status = queued.status;
  frame.status_detail = queued.detail;
  fill_place(frame, part);
  if (queued.status == FrameStatus::kOk) {
    fill_image(frame, part);
  } else {
    frame.image.release();
  }
  if (current_.is_done()) {
    current_.lease.reset();
    current_.queued.ring.reset();
  }
}

void V4l2Source::fill_place(Frame& frame, int part) const {
  const QueuedFrame& queued = current_.queued;
  const std::int64_t period_ns = agreement_.frame_period_ns();
  frame.bit_depth = agreement_.format->bit_depth;
  frame.sensor_size = agreement_.frame_size();
  frame.field = field_of(part);
  frame.grid = {};
  if (frame.field == Field::kTop) frame.grid = PixelGrid::top_field();
  if (frame.field == Field::kBottom) frame.grid = PixelGrid::bottom_field();
  frame.sequence = queued.place.frame;
  frame.exposures_per_picture = exposures_per_picture(agreement_);
  frame.exposure_in_picture = queued.place.exposure_in_picture + part;
  frame.field_period_ns = frame.exposures_per_picture == 2 ? period_ns / 2 : 0;
  frame.exposure_ns = exposure_ns_;
  frame.time.monotonic_ns = queued.place.midpoint_ns + part * frame.field_period_ns;
  frame.time.utc_offset_ns = utc_offset_now_ns();
  frame.illumination = Illumination::unknown();
  keys_.apply(frame, period_ns);
}

// Which rows a part of the current frame holds.
Field V4l2Source::field_of(int part) const {
  const Field first = agreement_.first_field();
  if (agreement_.is_one_field_a_buffer()) {
    const Field told = current_.queued.field;
    return told == Field::kProgressive ? first : told;
  }
  if (agreement_.is_sequential()) {
    if (part == 0) return first;
    return first == Field::kTop ? Field::kBottom : Field::kTop;
  }
  if (!agreement_.is_interlaced()) return Field::kProgressive;
  return first == Field::kTop ? Field::kInterlacedTopFirst : Field::kInterlacedBottomFirst;
}

RawImage V4l2Source::raw_part(int part) const {
  const QueuedFrame& queued = current_.queued;
  const int height = agreement_.buffer_height / current_.parts;
  const std::size_t skip =
      queued.buffer.offset + agreement_.stride * static_cast<std::size_t>(height * part);
  const std::size_t filled =
      queued.buffer.bytes > 0 ? queued.buffer.bytes : queued.ring->size(queued.buffer.index);
  return {queued.ring->data(queued.buffer.index) + skip, filled - std::min(filled, skip),
          agreement_.stride, agreement_.width, height};
}

void V4l2Source::fill_image(Frame& frame, int part) {
  constexpr int kDriverNeeds = 2;
  const PixelFormat& format = *agreement_.format;
  const RawImage raw = raw_part(part);
  const bool driver_runs_dry = current_.queued.ring->with_driver() < kDriverNeeds;
  if (format.is_usable_in_place() && !driver_runs_dry) {
    frame.image = view(format, raw);
    frame.lease = current_.lease;
  } else if (!convert(format, raw, frame.image)) {
    frame.image.release();
    frame.status = FrameStatus::kCorrupt;
    frame.status_detail = "the image does not decode to its end";
  }
}

}  // namespace

std::unique_ptr<FrameSource> open(const V4l2Options& options, std::shared_ptr<VideoCalls> calls) {
  return std::make_unique<V4l2Source>(options, std::move(calls));
}

}  // namespace striper::detail::v4l2

namespace striper {

std::unique_ptr<FrameSource> open_v4l2(const V4l2Options& options) {
  return detail::v4l2::open(options, detail::v4l2::system_video_calls());
}

}  // namespace striper
