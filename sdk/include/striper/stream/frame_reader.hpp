// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>

namespace striper {

/// When to stop reading a source that would go on.
struct FrameLimits {
  std::optional<std::uint64_t> pictures;  ///< Two fields of a frame count as one.
  std::optional<double> seconds;  ///< Of a live source's clock on the wall, of any other's frame
                                  ///< times.
};

/// How many frames there will be at most, where that is known.
std::optional<std::uint64_t> total_pictures(const FrameLimits& limits, const SourceInfo& source);

/// How to read frames.
struct FrameReading {
  FrameLimits limits;
  EventPort events;  ///< source_opened, source_silent, frames_dropped, frame_bad, ...
  std::function<bool()> should_stop;  ///< Asked ten times a second and before every frame.
  std::function<void()> on_wait;      ///< Nothing came for a tenth of a second.
};

/// What reading came to.
struct FrameReport {
  std::uint64_t pictures = 0;
  std::uint64_t frames = 0;
  double elapsed_s = 0.0;    ///< On the wall.
  bool interrupted = false;  ///< `should_stop` said so.
  bool is_lost = false;      ///< A camera ended by itself; it was not stopped.
  SourceStatistics statistics;

  /// Whether any frame was corrupt or of a wrong size.
  bool has_bad_frames() const noexcept { return statistics.corrupt + statistics.wrong_size > 0; }
  bool has_failed() const noexcept { return is_lost || has_bad_frames(); }
};

/// Reads a source once: starts it and hands every frame, good or bad, on, until the source ends, a
/// limit is reached or it is told to stop; then stops the source. Sends what is wrong with bad
/// frames (the first ten of them), how many a live source's numbers lack (at once, then every ten
/// seconds), that a camera keeps silent, and that it does not give the fps= that its address asks
/// for. Not thread-safe.
class FrameReader {
 public:
  explicit FrameReader(FrameSource& source, FrameReading how = {});
  ~FrameReader();

  /// @throws Error what `on_frame` and the source's `start` throw.
  FrameReport read(const std::function<void(const Frame&)>& on_frame);

  /// So far; may be asked in `on_frame`.
  const FrameReport& report() const noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
