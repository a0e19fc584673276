// SPDX-License-Identifier: Apache-2.0
#include "frame_loop.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>

#include <fmt/format.h>

#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>

#include "program.hpp"
#include "terminal.hpp"

namespace striper::program {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPatience = std::chrono::milliseconds(100);  // How late Ctrl-C may be noticed.
constexpr auto kSilence = std::chrono::seconds(5);          // Then the user should know.
constexpr std::uint64_t kReasonsSaid = 10;
// Cameras round a rate to what their clocks give: by a percent or two.
constexpr double kSameRate = 0.05;
// A second of pictures at the lowest usual rates, 5 a second, tells the rate to 20 %.
constexpr double kSlower = 0.2;
constexpr double kLeastSpan_s = 1.0;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Reads one source once.
class FrameLoop {
 public:
  FrameLoop(FrameSource& source, const FrameLimits& limits)
      : source_(source), info_(source.info()), limits_(limits), progress_("pictures", total()) {
    SourceUri uri = SourceUri::parse(info_.uri);
    asked_hz_ = uri.take_number("fps", 0.0, std::numeric_limits<double>::max());
    is_paced_ = info_.is_live || uri.take_bool("realtime").value_or(false);
  }

  FrameLoopResult read(const std::function<void(const Frame&)>& on_frame) {
    source_.start();
    compare_nominal_rate();
    if (info_.is_live) say(info_.description);  // What was chosen where the address says nothing.
    Frame frame;
    while (!is_finished() && receive(frame) && !begins_beyond_limit(frame)) {
      note(frame);
      on_frame(frame);
      progress_.update(result_.pictures);
    }
    if (!result_.is_lost) source_.stop();
    result_.elapsed_s = seconds_since(start_);
    result_.interrupted = stop_requested();
    result_.statistics = source_.statistics();
    compare_rate();
    return result_;
  }

 private:
  std::optional<std::uint64_t> total() const {
    if (!limits_.pictures || !info_.pictures) {
      return limits_.pictures ? limits_.pictures : info_.pictures;
    }
    return std::min(*limits_.pictures, *info_.pictures);
  }

  bool is_finished() const {
    if (stop_requested()) return true;
    if (limits_.seconds && info_.is_live && seconds_since(start_) >= *limits_.seconds) return true;
    return limits_.pictures && result_.pictures >= *limits_.pictures && picture_is_whole_;
  }

  // Waits for a frame; false at the source's end.
  bool receive(Frame& frame) {
    while (!is_finished()) {
      switch (source_.next(frame, kPatience)) {
        case NextStatus::kFrame:
          last_frame_ = Clock::now();
          return true;
        case NextStatus::kTimeout:
          complain_about_silence();
          break;
        case NextStatus::kEnd:
          result_.is_lost = info_.is_live && !info_.pictures;
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
    if (is_rate_said_) {
      say(fmt::format("warning: fps={:g} was asked for, and the camera is set to {:.4g}",
                      *asked_hz_, nominal_hz));
    }
  }

  // What came, lost ones included: on the wall, where that is what paces the source.
  void compare_rate() const {
    const double span_s = std::chrono::duration<double>(last_frame_ - first_frame_).count();
    if (!asked_hz_ || !is_paced_ || is_rate_said_ || span_s < kLeastSpan_s) return;
    const std::uint64_t pictures =
        result_.pictures + result_.statistics.dropped + result_.statistics.overrun;
    const double rate_hz = static_cast<double>(pictures - 1) / span_s;
    if (rate_hz > (1.0 - kSlower) * *asked_hz_) return;
    say(fmt::format("warning: fps={:g} was asked for, and {:.3g} pictures came in a second: {}",
                    *asked_hz_, rate_hz,
                    info_.is_live ? "is the exposure too long for that, or the connection too slow?"
                                  : "this machine is too slow for that"));
  }

  void complain_about_silence() {
    if (Clock::now() - last_frame_ < kSilence) return;
    last_frame_ = Clock::now();
    say(fmt::format("no picture for {} s; still waiting (Ctrl-C ends)", kSilence.count()));
  }

  // A frame that a limit rules out is only seen once it is there: the next picture where the last
  // field of the one before was lost, or a time that is too late.
  bool begins_beyond_limit(const Frame& frame) {
    if (limits_.pictures && result_.pictures >= *limits_.pictures && frame.sequence != sequence_) {
      return true;
    }
    const double time_s = 1e-9 * static_cast<double>(frame.time.monotonic_ns);
    if (result_.frames == 0) first_time_s_ = time_s;
    return limits_.seconds && !info_.is_live && time_s - first_time_s_ >= *limits_.seconds;
  }

  void note(const Frame& frame) {
    if (result_.frames == 0) first_frame_ = last_frame_;
    if (result_.frames == 0 || frame.sequence != sequence_) ++result_.pictures;
    ++result_.frames;
    sequence_ = frame.sequence;
    picture_is_whole_ =
        frame.is_interlaced() || frame.exposure_in_picture + 1 >= frame.exposures_per_picture;
    if (frame.status == FrameStatus::kOk) return;
    if (++bad_frames_ <= kReasonsSaid) {
      say(fmt::format("frame {}: {}", frame.sequence, frame.status_detail));
    } else if (bad_frames_ == kReasonsSaid + 1) {
      say("further bad frames are only counted");
    }
  }

  FrameSource& source_;
  SourceInfo info_;
  FrameLimits limits_;
  Progress progress_;
  FrameLoopResult result_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_frame_ = Clock::now();
  Clock::time_point first_frame_ = last_frame_;
  std::optional<double> asked_hz_;  // fps= of the address.
  bool is_paced_ = false;           // Pictures come when they are due.
  bool is_rate_said_ = false;
  std::uint64_t sequence_ = 0;
  std::uint64_t bad_frames_ = 0;
  bool picture_is_whole_ = false;
  double first_time_s_ = 0.0;
};

}  // namespace

void add_frame_limits(CLI::App& command, FrameLimits& limits) {
  command.add_option("--frames", limits.pictures, "Stop after so many pictures")
      ->type_name("N")
      ->check(above_zero());
  command.add_option("--seconds", limits.seconds, "Stop after so many seconds")
      ->type_name("S")
      ->check(above_zero());
}

FrameLoopResult read_frames(FrameSource& source, const FrameLimits& limits,
                            const std::function<void(const Frame&)>& on_frame) {
  const FrameLoopResult result = FrameLoop(source, limits).read(on_frame);
  if (result.frames == 0 && !result.interrupted) {
    throw NoPicture(ErrorKind::kDevice,
                    fmt::format("source '{}' gave no picture", source.info().uri));
  }
  return result;
}

void let_go(std::unique_ptr<FrameSource> source, const FrameLoopResult& result) {
  if (!result.is_lost) return;
  static_cast<void>(source.release());
  leave_threads_behind();
}

std::string describe(const FrameLoopResult& result) {
  std::string text =
      fmt::format("{} in {:.1f} s", count(result.pictures, "picture"), result.elapsed_s);
  if (result.elapsed_s > 0.0) {
    text += fmt::format(" ({:.1f}/s)", static_cast<double>(result.pictures) / result.elapsed_s);
  }
  const auto add = [&text](std::uint64_t number, const char* what) {
    if (number > 0) text += fmt::format(", {} {}", number, what);
  };
  add(result.statistics.dropped, "dropped");
  add(result.statistics.overrun, "discarded because this machine was too slow");
  add(result.statistics.corrupt, "corrupt");
  add(result.statistics.incomplete, "incomplete");
  add(result.statistics.wrong_size, "of wrong size");
  add(result.statistics.reconnects, "reconnections");
  if (result.interrupted) text += "; interrupted";
  if (result.is_lost) text += "; the camera was lost";
  return text;
}

}  // namespace striper::program
