// SPDX-License-Identifier: Apache-2.0
#include "camera/stream_exam.hpp"

#include <fmt/format.h>

#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {

void conclude_stream(const FrameReport& result, const SourceInfo& info,
                     std::vector<Event>& findings) {
  const SourceStatistics& got = result.statistics;
  if (got.dropped > 0 && !info.is_live) {
    findings.push_back(
        {"frames_dropped",
         fmt::format("{} missing between the frames' numbers", count(got.dropped, "number")),
         "each counts as a lost frame, over which the illumination pattern goes on; where the "
         "numbers "
         "are no count of frames, give names that are"});
  }
  if (info.is_live && got.dropped + got.incomplete > 0) {
    findings.push_back({Severity::kError, "frames_dropped",
                        fmt::format("frames lost on the way: {} never came, {} incomplete",
                                    got.dropped, got.incomplete),
                        info.uri.starts_with("gige:")
                            ? "larger socket buffer (`sysctl -w net.core.rmem_max=33554432`), "
                              "jumbo frames, packet_delay_us=, a better cable or switch; a "
                              "real-time stream thread (`setcap cap_sys_nice+ep` on this program)"
                            : "a slower rate, or a faster bus"});
  }
  if (result.is_lost) {
    findings.push_back({Severity::kError, "source_lost",
                        "the camera was lost, and is not to be opened again",
                        "cable, connector, power supply; without reconnect=no it is waited for"});
  }
  if (got.reconnects > 0) {
    findings.push_back({Severity::kError, "source_lost",
                        fmt::format("lost and opened again {}", count(got.reconnects, "time")),
                        "cable, connector, power supply"});
  }
  if (got.overrun > 0) {
    findings.push_back({"frames_dropped",
                        fmt::format("{} frames came faster than they were read", got.overrun),
                        "a lower fps, a region of interest, or a faster machine"});
  }
  if (got.corrupt > 0) {
    findings.push_back({Severity::kError, "frame_bad", count(got.corrupt, "damaged frame"),
                        info.is_live ? "cable, connector" : "damaged files: take them out"});
  }
  if (got.wrong_size > 0) {
    findings.push_back(
        {Severity::kError, "frame_bad",
         count(got.wrong_size, "frame") + " of another size, colour or depth than the first",
         info.is_live ? "cable, connector" : "images of one camera, in one format, to a source"});
  }
}

}  // namespace striper::program
