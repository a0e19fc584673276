// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include <opencv2/core/types.hpp>

#include <striper/core/controls.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>

namespace striper {

/// What a source is and gives, known once it is open.
struct SourceInfo {
  std::string uri;          ///< The URI that opens it again.
  std::string description;  ///< For people: make and model, or directory and number of frames.
  cv::Size image_size;      ///< Of the images that it gives (an interlaced frame: both fields).
  cv::Size sensor_size;     ///< What `Frame::grid` maps to.
  int bit_depth = 8;
  int channels = 1;
  Field field = Field::kProgressive;      ///< How its frames come (kTop stands for single fields).
  bool is_live = false;                   ///< Frames pass whether or not anyone asks for them.
  bool has_clock = false;                 ///< Times can be related to UTC.
  double picture_rate_hz = 0.0;           ///< Nominal; 0 if unknown.
  std::optional<std::uint64_t> pictures;  ///< How many there are in all, where that is known.
  IlluminationPattern pattern;            ///< From the URI's `laser=`; automatic if not given.

  /// What a frame is lit by, as far as its source knows or the pattern says; unknown where the two
  /// fields of an interlaced frame are lit differently.
  Illumination illumination_of(const Frame& frame) const noexcept {
    if (!frame.illumination.is_unknown()) return frame.illumination;
    const Illumination first = pattern.at(frame.exposure_number());
    const bool is_mixed = frame.is_interlaced() && pattern.at(frame.exposure_number() + 1) != first;
    return is_mixed ? Illumination::unknown() : first;
  }
};

/// Counts since `start`; never reset by reconnection.
struct SourceStatistics {
  std::uint64_t delivered = 0;  ///< Frames handed out by `next`, whatever their status.
  std::uint64_t dropped = 0;    ///< Frames that the sequence shows to be missing.
  std::uint64_t overrun =
      0;  ///< Frames discarded here because nobody asked in time (oldest first).
  std::uint64_t corrupt = 0;     ///< Delivered with FrameStatus::kCorrupt.
  std::uint64_t incomplete = 0;  ///< Delivered with FrameStatus::kIncomplete.
  std::uint64_t wrong_size = 0;  ///< Delivered with FrameStatus::kWrongSize.
  std::uint64_t reconnects = 0;  ///< Times a lost device was opened again.
};

enum class NextStatus {
  kFrame,    ///< A frame was delivered; look at its own status.
  kTimeout,  ///< Nothing arrived in time; ask again.
  kEnd,      ///< There will be no more frames.
  kStopped,  ///< The source is not started, or `stop` was called meanwhile.
};

/// Gives frames, one after the other, from a camera, from files or from the simulator.
///
/// Life: open (a constructor or `open_source`, throws Error) -> `start` -> `next` ... -> `stop` ->
/// `start` ... A file or simulated source starts again from its first frame. Destruction while
/// streaming is allowed.
///
/// Threads: one thread calls `start` and `next`; `stop` and `statistics` may be called from any
/// thread and `stop` makes a waiting `next` return kStopped.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  virtual SourceInfo info() const = 0;

  /// Begins to stream; no effect when already streaming.
  /// @throws Error if the device refuses.
  virtual void start() = 0;

  /// Waits at most `timeout` for the next frame and puts it into `frame`, whose old content is
  /// released (its memory is reused where the source can). Files time out in real time only.
  virtual NextStatus next(Frame& frame, std::chrono::milliseconds timeout) = 0;

  /// Stops streaming; frames already handed out stay valid. No effect when not streaming.
  virtual void stop() = 0;

  virtual SourceStatistics statistics() const = 0;

  /// What can be set while it runs; none for files. From any thread, as long as the source lives.
  virtual Controls& controls() { return no_controls_; }

 private:
  Controls no_controls_;
};

}  // namespace striper
