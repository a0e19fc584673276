// SPDX-License-Identifier: Apache-2.0
#include "run/frame_loop.hpp"

#include <string>

#include <fmt/format.h>

#include "program/program.hpp"
#include "program/terminal.hpp"

namespace striper::program {

void add_frame_limits(Command& command, FrameLimits& limits) {
  command.add_option("--frames", limits.pictures, "Stop after so many frames")
      ->type_name("N")
      ->check(above_zero());
  command.add_option("--seconds", limits.seconds, "Stop after so many seconds")
      ->type_name("S")
      ->check(above_zero());
}

void require_frames(const FrameReport& report, const std::string& source) {
  if (report.frames > 0 || report.interrupted) return;
  throw NoFrame(ErrorKind::kDevice, fmt::format("source '{}' gave no frame", source));
}

FrameReport read_frames(FrameSource& source, const FrameLimits& limits, const EventPort& events,
                        const std::function<void(const Frame&)>& on_frame) {
  const SourceInfo info = source.info();
  if (info.is_live) say(info.description);  // What was chosen where the address says nothing.
  FrameReader reader(source, {limits, events, stop_requested, {}});
  Progress progress("frames", total_pictures(limits, info));
  const FrameReport report = reader.read([&](const Frame& frame) {
    on_frame(frame);
    progress.update(reader.report().pictures);
  });
  require_frames(report, info.uri);
  return report;
}

void let_go(std::unique_ptr<FrameSource> source, const FrameReport& report) {
  if (!report.is_lost) return;
  static_cast<void>(source.release());
  leave_threads_behind();
}

std::string describe(const FrameReport& report) {
  std::string text =
      fmt::format("{} in {:.1f} s", count(report.pictures, "frame"), report.elapsed_s);
  if (report.elapsed_s > 0.0) {
    text += fmt::format(" ({:.1f}/s)", static_cast<double>(report.pictures) / report.elapsed_s);
  }
  const auto add = [&text](std::uint64_t number, const char* what) {
    if (number > 0) text += fmt::format(", {} {}", number, what);
  };
  add(report.statistics.dropped, "dropped");
  add(report.statistics.overrun, "discarded because this machine was too slow");
  add(report.statistics.corrupt, "corrupt");
  add(report.statistics.incomplete, "incomplete");
  add(report.statistics.wrong_size, "of wrong size");
  add(report.statistics.reconnects, "reconnections");
  if (report.interrupted) text += "; interrupted";
  if (report.is_lost) text += "; the camera was lost";
  return text;
}

}  // namespace striper::program
