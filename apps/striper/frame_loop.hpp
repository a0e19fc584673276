// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>

#include <striper/core/error.hpp>
#include <striper/core/frame_source.hpp>

namespace striper::program {

/// When to stop reading a source that would go on.
struct FrameLimits {
  std::optional<std::uint64_t> pictures;  ///< `--frames`: two fields of a picture count as one.
  std::optional<double> seconds;  ///< `--seconds`: of a live source's clock on the wall, of any
                                  ///< other's frame times.
};

void add_frame_limits(CLI::App& command, FrameLimits& limits);

/// A source that opened and then gave nothing.
class NoPicture : public Error {
 public:
  using Error::Error;
};

/// What reading came to.
struct FrameLoopResult {
  std::uint64_t pictures = 0;
  std::uint64_t frames = 0;
  double elapsed_s = 0.0;    ///< On the wall.
  bool interrupted = false;  ///< By Ctrl-C.
  bool is_lost = false;      ///< A camera ended by itself; it was not stopped.
  SourceStatistics statistics;

  /// Whether any picture was corrupt or of a wrong size.
  bool has_bad_pictures() const noexcept { return statistics.corrupt + statistics.wrong_size > 0; }
  bool has_failed() const noexcept { return is_lost || has_bad_pictures(); }
};

/// Starts the source and hands every frame, good or bad, to `on_frame` until the source ends, a
/// limit is reached or Ctrl-C comes; stops the source. Says what a live source is and how it was
/// set up, shows progress, says what is wrong with bad frames (the first ten of them), that a
/// camera keeps silent, and that it does not give the fps= that its address asks for.
///
/// @throws Error what `on_frame` and `start` throw; NoPicture where a source gave no frame.
FrameLoopResult read_frames(FrameSource& source, const FrameLimits& limits,
                            const std::function<void(const Frame&)>& on_frame);

/// Closes the source. That of a lost camera is left as it is, since it would wait for answers for
/// seconds, and the process then ends without its destructors (`leave_threads_behind`).
void let_go(std::unique_ptr<FrameSource> source, const FrameLoopResult& result);

/// "120 pictures in 4.0 s (30.0/s), 2 dropped, 1 corrupt": for the summary.
std::string describe(const FrameLoopResult& result);

}  // namespace striper::program
