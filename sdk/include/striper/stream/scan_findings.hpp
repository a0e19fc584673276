// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <striper/core/frame_time.hpp>
#include <striper/detect/curb_csv.hpp>
#include <striper/detect/object_csv.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper {

/// Which scan something was found in.
struct ScanStamp {
  std::string head;
  std::string frame_id;  ///< `HEAD_scanK`; empty where the scan has no frame.
  int laser = 0;
  std::uint64_t sequence = 0;
  FrameTime time;

  ScanStamp() = default;
  explicit ScanStamp(const PolarScan& scan);
};

/// The curbs that are tracked at one scan, for sinks: of each the line of `curbs.csv`. Without
/// lines it was looked for some and nothing is there.
struct CurbsSeen {
  ScanStamp scan;
  std::vector<CurbLine> lines;

  CurbsSeen() = default;
  CurbsSeen(const PolarScan& scan_in, std::span<const CurbTrack> tracks);
};

/// The same of objects, as in `objects.csv`.
struct ObjectsSeen {
  ScanStamp scan;
  std::vector<ObjectLine> lines;

  ObjectsSeen() = default;
  ObjectsSeen(const PolarScan& scan_in, std::span<const ObjectTrack> tracks);
};

}  // namespace striper
