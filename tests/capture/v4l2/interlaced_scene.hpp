// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include <linux/videodev2.h>

#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/model/striper_model.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper::testing {

/// How an image travels: the pixel format, order of fields and standard of a V4L2 device.
struct Television {
  std::string name;
  std::uint32_t code = V4L2_PIX_FMT_GREY;
  std::uint32_t field = V4L2_FIELD_INTERLACED;
  v4l2_std_id standard = V4L2_STD_NTSC_M;

  bool is_525() const noexcept { return (standard & V4L2_STD_525_60) != 0; }
  bool is_bottom_first() const noexcept;
  int lines() const noexcept { return is_525() ? 480 : 576; }
  double picture_rate_hz() const noexcept { return is_525() ? 30000.0 / 1001.0 : 25.0; }

  /// `standard=ntsc-m&format=GREY`, with `field=` where the driver's own choice is another.
  std::string query() const;
};

inline void PrintTo(const Television& way, std::ostream* out) { *out << way.name; }

/// NTSC and PAL, interlaced, sequential and alternate with both orders of fields, GREY, YUYV and
/// Y16.
std::vector<Television> ways_of_television();

/// One frame of the scene of data/scenes/ntsc_grabber.yaml (sun, a wall, a box; the laser in the
/// first field alone), as a camera of such a television gives it.
struct InterlacedScene {
  Frame whole;  ///< Both fields interlaced.
  StriperModel model;

  explicit InterlacedScene(const Television& way);

  /// What the simulator gives for an exposure that came from elsewhere: its own pixels, field and
  /// grid, with the number, time and status of the other.
  Frame as_if_simulated(const Frame& came) const;
};

/// Scans what came through a camera and what the simulator gives for the same exposures, side by
/// side: a scan depends a little on which frames came before it.
class SideBySide {
 public:
  /// @param scene must outlive this.
  SideBySide(const InterlacedScene& scene, const IlluminationPattern& pattern);

  void process(const Frame& came);
  void finish();

  /// The largest difference of two ranges; infinite where the scans are not the same.
  double worst_m() const noexcept { return worst_m_; }

  /// The same against the scan of a stream without faults, in standard deviations.
  double worst_sigmas() const noexcept { return worst_sigmas_; }

  /// The frames that gave a scan, in order.
  const std::vector<std::uint64_t>& scanned() const noexcept { return scanned_; }

  /// Columns of the scene that give a good return.
  int good_columns() const noexcept;
  const ScannerStatistics& statistics() const noexcept { return of_camera_.statistics(); }

 private:
  void compare(ScanSpan camera, ScanSpan simulator);

  const InterlacedScene& scene_;
  Scanner of_camera_;
  Scanner of_simulator_;
  PolarScan undisturbed_;
  double worst_m_ = 0.0;
  double worst_sigmas_ = 0.0;
  std::vector<std::uint64_t> scanned_;
};

/// The driver's buffers for an image: one, or two fields in the order of their exposure.
std::vector<std::vector<std::uint8_t>> buffers_of(const cv::Mat& image, const Television& way);

/// How many rows of a frame, whichever field it is, are those of the image, bit for bit.
int lines_of(const Frame& frame, const cv::Mat& image);

/// Whether every row of a frame, whichever field it is, is that of the image, bit for bit.
bool is_part_of(const Frame& frame, const cv::Mat& image);

/// Which frames must give a scan when the laser fires in the first field of each: those whose
/// first field came whole, with the field just before or just after it. In order; an interlaced
/// frame counts as both of its fields.
/// @param frames all that came; only numbers, field and status are looked at.
std::vector<std::uint64_t> frames_with_a_pair(const std::vector<Frame>& frames);

/// A frame without its pixels.
Frame without_pixels(const Frame& frame);

}  // namespace striper::testing
