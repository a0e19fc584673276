// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
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
  SourceStatistics statistics;

  /// Whether any picture was corrupt or of a wrong size.
  bool has_bad_pictures() const noexcept { return statistics.corrupt + statistics.wrong_size > 0; }
};

/// Starts the source and hands every frame, good or bad, to `on_frame` until the source ends, a
/// limit is reached or Ctrl-C comes; stops the source. Says what a live source is and how it was
/// set up, shows progress, says what is wrong with bad frames (the first ten of them) and that a
/// camera keeps silent.
///
/// @throws Error what `on_frame` and `start` throw; NoPicture where a source gave no frame.
FrameLoopResult read_frames(FrameSource& source, const FrameLimits& limits,
                            const std::function<void(const Frame&)>& on_frame);

/// "120 pictures in 4.0 s (30.0/s), 2 dropped, 1 corrupt": for the summary.
std::string describe(const FrameLoopResult& result);

}  // namespace striper::program
