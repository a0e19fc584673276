// SPDX-License-Identifier: Apache-2.0
#include <striper/stream/scan_findings.hpp>

namespace striper {
namespace {

// A line with what all lines of a scan have.
template <typename Line>
Line line_of(const ScanStamp& scan) {
  Line line;
  line.frame = scan.sequence;
  line.time_s = scan.time.seconds();
  line.head = scan.head;
  line.laser = scan.laser;
  return line;
}

}  // namespace

ScanStamp::ScanStamp(const PolarScan& scan)
    : head(scan.head()),
      frame_id(scan.frame ? scan.frame->frame_id : std::string()),
      laser(scan.laser),
      sequence(scan.sequence),
      time(scan.time) {}

CurbsSeen::CurbsSeen(const PolarScan& scan_in, std::span<const CurbTrack> tracks) : scan(scan_in) {
  for (const CurbTrack& track : tracks) {
    lines.push_back(line_of<CurbLine>(scan));
    lines.back().track = track;
  }
}

ObjectsSeen::ObjectsSeen(const PolarScan& scan_in, std::span<const ObjectTrack> tracks)
    : scan(scan_in) {
  for (const ObjectTrack& track : tracks) {
    lines.push_back(line_of<ObjectLine>(scan));
    lines.back().set(track);
  }
}

}  // namespace striper
