// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <striper/core/uri.hpp>
#include <striper/stream/frame_reader.hpp>

namespace striper {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPatience = std::chrono::milliseconds(100);  // How late a stop may be noticed.
constexpr auto kSilence = std::chrono::seconds(5);          // Then the user should know.
constexpr std::uint64_t kReasonsSaid = 10;
constexpr auto kDropsEvery = std::chrono::seconds(10);  // A bad cable must not fill a log.
// Cameras round a rate to what their clocks give: by a percent or two.
constexpr double kSameRate = 0.05;
// A second of frames at the lowest usual rates, 5 a second, tells the rate to 20 %.
constexpr double kSlower = 0.2;
constexpr double kLeastSpan_s = 1.0;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// What an address of any kind says of its pace.
class Pace : public Uri {
 public:
  explicit Pace(const std::string& uri) : Uri("source", uri) {
    asked_hz = take_number("fps", 0.0, std::numeric_limits<double>::max());
    is_realtime = take_bool("realtime").value_or(false);
  }

  std::optional<double> asked_hz;
  bool is_realtime = false;
};

}  // namespace

std::optional<std::uint64_t> total_pictures(const FrameLimits& limits, const SourceInfo& source) {
  if (!limits.pictures || !source.pictures) {
    return limits.pictures ? limits.pictures : source.pictures;
  }
  return std::min(*limits.pictures, *source.pictures);
}

class FrameReader::Impl {
 public:
  Impl(FrameSource& source, FrameReading how)
      : source_(source), info_(source.info()), how_(std::move(how)) {
    const Pace pace(info_.uri);
    asked_hz_ = pace.asked_hz;
    is_paced_ = info_.is_live || pace.is_realtime;
  }

  FrameReport read(const std::function<void(const Frame&)>& on_frame) {
    source_.start();
    how_.events.send({"source_opened", info_.description});
    compare_nominal_rate();
    Frame frame;
    while (!is_finished() && receive(frame) && !begins_beyond_limit(frame)) {
      note(frame);
      on_frame(frame);
    }
    if (!report_.is_lost) source_.stop();
    report_.elapsed_s = seconds_since(start_);
    report_.interrupted = should_stop();
    report_.statistics = source_.statistics();
    say_missing();
    compare_rate();
    return report_;
  }

  const FrameReport& report() const noexcept { return report_; }

 private:
  bool should_stop() const { return how_.should_stop && how_.should_stop(); }

  bool is_finished() const {
    const FrameLimits& limits = how_.limits;
    if (should_stop()) return true;
    if (limits.seconds && info_.is_live && seconds_since(start_) >= *limits.seconds) return true;
    return limits.pictures && report_.pictures >= *limits.pictures && frame_is_whole_;
  }

  // Waits for a frame; false at the source's end.
  bool receive(Frame& frame) {
    while (!is_finished()) {
      switch (source_.next(frame, kPatience)) {
        case NextStatus::kFrame:
          last_frame_ = Clock::now();
          is_silence_said_ = false;
          return true;
        case NextStatus::kTimeout:
          complain_about_silence();
          if (how_.on_wait) how_.on_wait();
          break;
        case NextStatus::kEnd:
          report_.is_lost = info_.is_live && !info_.pictures;
          return false;
        case NextStatus::kStopped:
          return false;
      }
    }
    return false;
  }

  // What the camera says that it will give.
  void compare_nominal_rate() {
    const double nominal_hz = info_.picture_rate_hz;
    if (!asked_hz_ || !info_.is_live || nominal_hz <= 0.0) return;
    is_rate_said_ = std::abs(nominal_hz - *asked_hz_) > kSameRate * *asked_hz_;
    if (!is_rate_said_) return;
    how_.events.send(
        {"setting_adjusted", fmt::format("fps={:g} was asked for, and the camera is set to {:.4g}",
                                         *asked_hz_, nominal_hz)});
  }

  // What came, lost ones included: on the wall, where that is what paces the source.
  void compare_rate() const {
    const double span_s = std::chrono::duration<double>(last_frame_ - first_frame_).count();
    if (!asked_hz_ || !is_paced_ || is_rate_said_ || span_s < kLeastSpan_s) return;
    const std::uint64_t frames =
        report_.pictures + report_.statistics.dropped + report_.statistics.overrun;
    const double rate_hz = static_cast<double>(frames - 1) / span_s;
    if (rate_hz > (1.0 - kSlower) * *asked_hz_) return;
    how_.events.send(
        {"rate_low",
         fmt::format(
             "fps={:g} was asked for, and {:.3g} frames came in a second: {}", *asked_hz_, rate_hz,
             info_.is_live ? "is the exposure too long for that, or the connection too slow?"
                           : "this machine is too slow for that")});
  }

  // Once a silence.
  void complain_about_silence() {
    if (!info_.is_live || is_silence_said_ || Clock::now() - last_frame_ < kSilence) return;
    is_silence_said_ = true;
    how_.events.send(
        {"source_silent", fmt::format("no frame for {} s; still waiting", kSilence.count())});
  }

  // A frame that a limit rules out is only seen once it is there: the next frame where the last
  // field of the one before was lost, or a time that is too late.
  bool begins_beyond_limit(const Frame& frame) {
    const FrameLimits& limits = how_.limits;
    if (limits.pictures && report_.pictures >= *limits.pictures && frame.sequence != sequence_) {
      return true;
    }
    const double time_s = 1e-9 * static_cast<double>(frame.time.monotonic_ns);
    if (report_.frames == 0) first_time_s_ = time_s;
    return limits.seconds && !info_.is_live && time_s - first_time_s_ >= *limits.seconds;
  }

  // The numbers of frames that a live source took and that did not come. Those that are missing
  // because it was lost are said by source_lost; a file's numbers are its own.
  void look_for_gap(const Frame& frame) {
    if (!info_.is_live || report_.frames == 0 || frame.sequence <= sequence_ + 1) return;
    const std::uint64_t reconnects = source_.statistics().reconnects;
    if (std::exchange(reconnects_, reconnects) != reconnects) return;
    missing_ += frame.sequence - sequence_ - 1;
    if (!missing_said_ || last_frame_ - *missing_said_ >= kDropsEvery) say_missing();
  }

  void say_missing() {
    if (missing_ == 0) return;
    how_.events.send({"frames_dropped",
                      fmt::format("{} frames are missing between those that came", missing_),
                      "`striper doctor` says where they are lost"});
    missing_ = 0;
    missing_said_ = last_frame_;
  }

  void note(const Frame& frame) {
    look_for_gap(frame);
    if (report_.frames == 0) first_frame_ = last_frame_;
    if (report_.frames == 0 || frame.sequence != sequence_) ++report_.pictures;
    ++report_.frames;
    sequence_ = frame.sequence;
    frame_is_whole_ =
        frame.is_interlaced() || frame.exposure_in_picture + 1 >= frame.exposures_per_picture;
    if (frame.status == FrameStatus::kOk) return;
    if (++bad_frames_ <= kReasonsSaid) {
      how_.events.send(
          {"frame_bad", fmt::format("frame {}: {}", frame.sequence, frame.status_detail)});
    } else if (bad_frames_ == kReasonsSaid + 1) {
      how_.events.send({"frame_bad", "further bad frames are only counted"});
    }
  }

  FrameSource& source_;
  SourceInfo info_;
  FrameReading how_;
  FrameReport report_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_frame_ = Clock::now();
  Clock::time_point first_frame_ = last_frame_;
  std::optional<double> asked_hz_;  // fps= of the address.
  bool is_paced_ = false;           // Frames come when they are due.
  bool is_rate_said_ = false;
  bool is_silence_said_ = false;
  std::uint64_t sequence_ = 0;
  std::uint64_t bad_frames_ = 0;
  std::uint64_t missing_ = 0;  // Not said yet.
  std::uint64_t reconnects_ = 0;
  std::optional<Clock::time_point> missing_said_;
  bool frame_is_whole_ = false;
  double first_time_s_ = 0.0;
};

FrameReader::FrameReader(FrameSource& source, FrameReading how)
    : impl_(std::make_unique<Impl>(source, std::move(how))) {}

FrameReader::~FrameReader() = default;

FrameReport FrameReader::read(const std::function<void(const Frame&)>& on_frame) {
  return impl_->read(on_frame);
}

const FrameReport& FrameReader::report() const noexcept { return impl_->report(); }

}  // namespace striper
