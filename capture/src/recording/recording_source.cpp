// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/recording/recording_source.hpp>

#include "capture/common_keys.hpp"
#include "capture/frame_counts.hpp"
#include "capture/frame_shapes.hpp"
#include "recording/recorded_frames.hpp"

namespace striper {
namespace {

using Clock = std::chrono::steady_clock;
using detail::RecordedFrames;
constexpr double kNsPerSecond = 1e9;

bool is_single_field(Field field) { return field == Field::kTop || field == Field::kBottom; }

}  // namespace

RecordingOptions RecordingOptions::from_uri(SourceUri uri) {
  RecordingOptions options;
  const auto common = detail::CommonKeys::take(uri);
  options.pattern = common.pattern;
  options.fields = common.fields;
  options.path = uri.path();
  options.head = uri.take("head").value_or("");
  options.is_realtime = uri.take_bool("realtime").value_or(false);
  if (const auto given = uri.take_integer("bits", 9, 16)) options.bits = static_cast<int>(*given);
  uri.refuse_unused(fmt::format("head, realtime, bits, {}", detail::CommonKeys::kKnown));
  options.uri = uri.text();
  return options;
}

struct RecordingSource::State {
  explicit State(const RecordingOptions& options_in)
      : options(options_in), common{options.pattern, options.fields} {
    info.uri = options.uri.empty() ? "mcap:" + options.path : options.uri;
  }

  RecordingOptions options;
  detail::CommonKeys common;
  std::int64_t frame_period_ns = 0;
  SourceInfo info;

  // Of the thread that calls `start` and `next`.
  std::unique_ptr<RecordedFrames> frames;
  detail::FrameShapes shapes;
  std::optional<Clock::time_point> begin;  // When the first frame was due.
  std::int64_t begin_ns = 0;               // Its own time.
  bool has_ended = false;
  std::optional<Frame> waiting;  // Read and not due yet.

  mutable std::mutex mutex;
  std::condition_variable stopped;
  bool is_streaming = false;

  detail::FrameCounts counts;

  void look_at_first_frame();
  void rewind();
  NextStatus read(Frame& frame);
  void require_shape(Frame& frame);
  NextStatus wait_until_due(const Frame& frame, Clock::time_point end);
  void say_end();
};

// What the recording says of its source, else the first frame that can be read.
void RecordingSource::State::look_at_first_frame() {
  RecordedFrames recorded(options.path, options.head);
  const bool is_told = recorded.tell_of_source(info);
  Frame first;
  bool is_any = recorded.next(first);
  if (!is_any) {
    const bool is_cut = recorded.reader().is_cut_at_beginning();
    throw Error(ErrorKind::kNotFound,
                fmt::format("'{}' holds no images{}", options.path,
                            is_cut ? ": it was cut off before its first message" : ""));
  }
  info.description = fmt::format("frames of '{}' (a recording)", options.path);
  info.has_clock = first.time.utc_offset_ns.has_value();
  info.field = first.field;
  if (info.field == Field::kBottom) info.field = Field::kTop;  // Stands for single fields.
  if (!recorded.pattern().is_automatic()) info.pattern = recorded.pattern();
  if (!is_single_field(info.field)) info.pictures = recorded.count();
  while (!is_told && is_any && first.image.empty()) is_any = recorded.next(first);
  if (!is_told && is_any) {
    info.image_size = first.image.size();
    info.sensor_size = first.sensor_size;
    info.bit_depth = options.bits.value_or(first.bit_depth);
    info.channels = first.image.channels();
  }
  if (options.bits && is_any && first.image.depth() != CV_16U) {
    throw Error(ErrorKind::kUsage, fmt::format("source '{}': bits={} - but its images have 8 bits",
                                               info.uri, *options.bits));
  }
  common.apply(info);
  if (info.picture_rate_hz > 0.0) {
    frame_period_ns = std::llround(kNsPerSecond / info.picture_rate_hz);
  }
}

void RecordingSource::State::rewind() {
  frames = std::make_unique<RecordedFrames>(options.path, options.head);
  shapes.reset();
  counts.reset();
  begin.reset();
  has_ended = false;
  waiting.reset();
}

NextStatus RecordingSource::State::read(Frame& frame) {
  if (has_ended) return NextStatus::kEnd;
  if (!frames->next(frame)) {
    has_ended = true;
    say_end();
    return NextStatus::kEnd;
  }
  if (options.bits) frame.bit_depth = *options.bits;
  common.apply(frame, frame_period_ns);
  require_shape(frame);
  return NextStatus::kFrame;
}

void RecordingSource::State::require_shape(Frame& frame) {
  if (frame.status != FrameStatus::kOk) return;
  const std::string difference = shapes.difference(frame);
  if (difference.empty()) return;
  frame.status = FrameStatus::kWrongSize;
  frame.status_detail =
      fmt::format("image {} of '{}' {}", frame.sequence, options.path, difference);
}

NextStatus RecordingSource::State::wait_until_due(const Frame& frame, Clock::time_point end) {
  if (!begin) {
    begin = Clock::now();
    begin_ns = frame.time.monotonic_ns;
  }
  const Clock::time_point due =
      *begin + std::chrono::nanoseconds(frame.time.monotonic_ns - begin_ns);
  std::unique_lock lock(mutex);
  const bool is_stopped =
      stopped.wait_until(lock, std::min(due, end), [this] { return !is_streaming; });
  if (is_stopped) return NextStatus::kStopped;
  return due > end ? NextStatus::kTimeout : NextStatus::kFrame;
}

void RecordingSource::State::say_end() {
  const wire::McapReader& reader = frames->reader();
  const auto& damages = reader.damages();
  if (damages.empty()) return;
  const bool is_only_cut = reader.end() == wire::McapEnd::kCut && damages.size() == 1;
  const std::string text =
      is_only_cut ? fmt::format("'{}' was cut off and is read to its last whole chunk, byte {}",
                                options.path, reader.whole_bytes())
                  : fmt::format("'{}' is damaged; what could not be read is left out: {}",
                                options.path, damages.front().reason);
  options.events.send({"recording_cut", text});
}

RecordingSource::RecordingSource(const RecordingOptions& options)
    : state_(std::make_unique<State>(options)) {
  state_->look_at_first_frame();
}

RecordingSource::~RecordingSource() = default;

SourceInfo RecordingSource::info() const { return state_->info; }

void RecordingSource::start() {
  const std::lock_guard lock(state_->mutex);
  if (state_->is_streaming) return;
  state_->rewind();
  state_->is_streaming = true;
}

NextStatus RecordingSource::next(Frame& frame, std::chrono::milliseconds timeout) {
  const Clock::time_point end = Clock::now() + timeout;
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->is_streaming) return NextStatus::kStopped;
  }
  if (state_->waiting) {
    frame = std::move(*state_->waiting);
    state_->waiting.reset();
  } else if (const NextStatus status = state_->read(frame); status != NextStatus::kFrame) {
    return status;
  }
  if (state_->options.is_realtime) {
    const NextStatus status = state_->wait_until_due(frame, end);
    if (status == NextStatus::kTimeout) {
      state_->waiting = std::move(frame);
      return status;
    }
    if (status != NextStatus::kFrame) return status;
  }
  state_->counts.deliver_recorded(frame);
  return NextStatus::kFrame;
}

void RecordingSource::stop() {
  const std::lock_guard lock(state_->mutex);
  state_->is_streaming = false;
  state_->stopped.notify_all();
}

SourceStatistics RecordingSource::statistics() const { return state_->counts.now(); }

}  // namespace striper
