// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <opencv2/core/types.hpp>

#include <striper/core/frame_time.hpp>
#include <striper/core/pixel_grid.hpp>
#include <striper/model/striper_model.hpp>
#include <striper/scan/polar_scan.hpp>
#include <striper/wire/ros_messages.hpp>
#include <striper/wire/striper_messages.hpp>

// Scans as messages. All write into messages that are used again, so that a stream allocates
// nothing. Thread-safe on different messages.
namespace striper {

/// UTC, or the time since the first frame where the source has no clock.
wire::Time to_stamp(const FrameTime& time) noexcept;

/// Every number of a scan; `from_message` gives it back to the bit. What a message has not: the
/// frame's model and transform, and `is_stripe_seen`.
void to_message(const PolarScan& scan, wire::PolarScan& message);

/// The inverse. `scan.frame` is left as it is. @throws Error{kBadFile} where arrays differ in
/// length or a number stands for nothing.
void from_message(const wire::PolarScan& message, PolarScan& scan);

/// A point per scan line of the image, in the scan's own plane (z = 0); NaN where there is none.
/// Offsets 0, 4, ... 28: x y z intensity sigma sigma_cal width confidence; status at 32
/// (wire/return_code.hpp).
void to_message(const PolarScan& scan, wire::PointCloud2& message);

/// The bearings of a LaserScan: fixed per head and laser, as its readers expect.
struct LaserScanGrid {
  double angle_min_rad = 0.0;
  double angle_max_rad = 0.0;
  int bearings = 0;  ///< 2 or more.
  double range_min_m = 0.1;
  double range_max_m = 10.0;

  double increment_rad() const noexcept { return (angle_max_rad - angle_min_rad) / (bearings - 1); }
};

/// The grid of a laser's scans: from the least to the greatest bearing of the image's pixels whose
/// range is within the limits, a bearing for each scan line. Looks at every pixel: .1 s at 640x480.
/// @param pixels where the image's pixels are on the sensor. @param size of the image, pixels.
/// @throws Error{kBadValue} where the model has no such laser, {kUntrustworthy} where no pixel sees
/// its plane within the limits.
LaserScanGrid make_laser_scan_grid(const StriperModel& model, int laser, const PixelGrid& pixels,
                                   cv::Size size, double range_min_m = 0.1,
                                   double range_max_m = 10.0);

/// Puts scans on a grid of bearings: each holds the return nearest in bearing within one step, of
/// two as near the closer one; +inf where there is none, NaN where it is doubtful.
class LaserScanMaker {
 public:
  /// @throws Error{kBadValue} for a grid that is none.
  explicit LaserScanMaker(const LaserScanGrid& grid);

  void to_message(const PolarScan& scan, wire::LaserScan& message);

  const LaserScanGrid& grid() const noexcept { return grid_; }

 private:
  void place(const Return& value, int bearing, wire::LaserScan& message);

  LaserScanGrid grid_;
  std::vector<double> distances_;  ///< In bearing, of the return that each holds; in steps.
  std::vector<double> ranges_;     ///< Of that return.
};

/// The LaserScans of a model, each laser's on a grid over the whole sensor: it does not move with a
/// region of interest.
class LaserScans {
 public:
  LaserScans() = default;
  explicit LaserScans(const StriperModel& model);

  /// False, and the message is left as it is, where no pixel sees the laser's plane.
  bool to_message(const PolarScan& scan, wire::LaserScan& message);

 private:
  std::vector<std::optional<LaserScanMaker>> makers_;  // Of each laser.
};

}  // namespace striper
