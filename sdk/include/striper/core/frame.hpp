// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <opencv2/core/mat.hpp>

#include <striper/core/frame_time.hpp>
#include <striper/core/illumination.hpp>
#include <striper/core/pixel_grid.hpp>

namespace striper {

/// Which rows of the frame an image holds. The top field is rows 0, 2, 4, ... of the full
/// frame.
enum class Field : std::uint8_t {
  kProgressive,            ///< All rows, exposed together.
  kTop,                    ///< One field alone: rows 0, 2, 4, ...
  kBottom,                 ///< One field alone: rows 1, 3, 5, ...
  kInterlacedTopFirst,     ///< Two fields in one image, the top one exposed first.
  kInterlacedBottomFirst,  ///< Two fields in one image, the bottom one exposed first.
};

/// The largest value that a pixel of so many significant bits can take.
constexpr int full_scale_dn(int bit_depth) noexcept { return (1 << bit_depth) - 1; }

/// The source's own verdict on a frame. For anything but kOk only `sequence`, `time`, `status` and
/// `status_detail` may be relied on, and the image may be empty.
enum class FrameStatus : std::uint8_t {
  kOk,
  kCorrupt,  ///< Damaged data: an error-flagged buffer, an image that does not decode to its end.
  kIncomplete,  ///< Parts never arrived (lost packets).
  kWrongSize,   ///< Not the size or pixel type of the stream that it belongs to.
};

/// Holds one exposure, or the two fields of an interlaced frame, with all that is needed to use it
/// later on.
///
/// Copying a Frame shares the image (cv::Mat is reference-counted); treat the pixels as read-only.
struct Frame {
  cv::Mat image;      ///< CV_8UC1, CV_16UC1, CV_8UC3 or CV_16UC3 (B, G, R as in OpenCV).
  int bit_depth = 8;  ///< Significant bits, 8 to 16: see full_scale_dn.
  cv::Size
      sensor_size;  ///< The full sensor, in the pixels that `grid` maps to: what the model is of.
  PixelGrid grid;
  std::string head;  ///< Which striper's; filled in where frames of several meet (ScanBus).

  /// The source's number of the frame; a gap is a lost frame. Two fields of a frame share it.
  std::uint64_t sequence = 0;
  /// How often the source began anew before this frame, each time anywhere in the illumination
  /// pattern: a camera that was opened again and does not switch the laser itself.
  std::uint32_t epoch = 0;
  int exposure_in_picture = 0;  ///< 0 or 1: which of the frame's exposures in time this is.
  int exposures_per_picture =
      1;  ///< 2 for interlaced sources, whether interlaced or field by field.

  FrameTime time;  ///< Exposure midpoint (of the first field of an interlaced frame).
  std::int64_t field_period_ns = 0;  ///< From the first to the second field; 0 for progressive.
  std::int64_t exposure_ns = 0;      ///< How long the shutter was open; 0 if unknown.

  /// What a wheel's counter showed at the exposure, where the camera has one (odometer, encoder);
  /// as it was read, so it may wrap.
  std::optional<std::int64_t> encoder_counts;

  /// What the source knows to have lit it: the light that it commanded, a simulation's truth, a
  /// recording of either. What a person says of all frames is `SourceInfo::pattern`.
  Illumination illumination;
  Field field = Field::kProgressive;

  FrameStatus status = FrameStatus::kOk;
  std::string status_detail;  ///< For people, names the file or cause; empty when kOk.

  /// Keeps the buffer that `image` points into (a camera's mapped memory); empty if `image` owns
  /// it.
  std::shared_ptr<const void> lease;

  /// The largest value that a pixel can take: at or above it the pixel is saturated.
  int full_scale_dn() const noexcept { return striper::full_scale_dn(bit_depth); }

  /// Number of the exposure in time order: the position in the illumination pattern, gaps included.
  std::uint64_t exposure_number() const noexcept {
    return sequence * static_cast<std::uint64_t>(exposures_per_picture) +
           static_cast<std::uint64_t>(exposure_in_picture);
  }

  bool is_interlaced() const noexcept {
    return field == Field::kInterlacedTopFirst || field == Field::kInterlacedBottomFirst;
  }
};

/// Whether nobody else would see it if these pixels were overwritten. Read atomically, as it is
/// written: another thread may be letting go of its copy, and must have read all it wanted.
inline bool is_sole_owner(const cv::Mat& image) {
  return image.u != nullptr && CV_XADD(&image.u->refcount, 0) == 1;
}

}  // namespace striper
