// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <striper/core/error.hpp>
#include <striper/stream/frame_reader.hpp>

#include "program/command.hpp"

namespace striper::program {

/// `--frames` and `--seconds`.
void add_frame_limits(Command& command, FrameLimits& limits);

/// A source that opened and then gave nothing.
class NoFrame : public Error {
 public:
  using Error::Error;
};

/// @throws NoFrame where a source gave no frame and nobody stopped it.
void require_frames(const FrameReport& report, const std::string& source);

/// Reads a source as a FrameReader does, until Ctrl-C at the latest, in front of a person: says
/// what a live source is and how it was set up, and shows progress.
/// @param events hears of bad frames, silence, a rate that is too low.
/// @throws Error what `on_frame` and `start` throw; NoFrame.
FrameReport read_frames(FrameSource& source, const FrameLimits& limits, const EventPort& events,
                        const std::function<void(const Frame&)>& on_frame);

/// Closes the source. That of a lost camera is left as it is, since it would wait for answers for
/// seconds, and the process then ends without its destructors (`leave_threads_behind`).
void let_go(std::unique_ptr<FrameSource> source, const FrameReport& report);

/// "120 frames in 4.0 s (30.0/s), 2 dropped, 1 corrupt": for the summary.
std::string describe(const FrameReport& report);

}  // namespace striper::program
