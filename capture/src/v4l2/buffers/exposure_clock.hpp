// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include <striper/core/frame.hpp>

namespace striper::detail::v4l2 {

/// What the driver stamped a buffer with.
struct BufferStamp {
  std::uint32_t sequence = 0;         ///< The driver's own count, which wraps around.
  std::int64_t time_ns = 0;           ///< CLOCK_MONOTONIC.
  bool is_start_of_exposure = false;  ///< Otherwise the stamp is the end of the frame.
  Field field = Field::kProgressive;  ///< kTop or kBottom where a buffer is one field.
};

/// Where an exposure belongs.
struct ExposurePlace {
  std::uint64_t frame = 0;
  int exposure_in_picture = 0;
  std::int64_t midpoint_ns = 0;   ///< Of the buffer's first exposure.
  std::int64_t began_ns = 0;      ///< When that began, by the stamp alone.
  std::uint64_t lost_frames = 0;  ///< Missing before this one, by the driver's count.
};

/// Numbers and times exposures from the driver's stamps.
///
/// Numbers. Frames count up from 0 by the driver's differences, over its wrap-around; after an
/// interruption by the time that passed, so that a pattern of the laser keeps its phase. Drivers
/// that give one field a buffer either count frames (the kernel's rule: both fields have the same
/// number) or fields; which one shows with the first pair of fields that follow each other closely.
///
/// Times. Of a stamp at the end of the frame: half the frame's (field's) period before it; of
/// one at the start of the exposure: half the exposure after it, or half the period where its
/// length is unknown. Where a buffer holds two fields this is about the first of them. Times only
/// ever grow, from field to field too, however late a driver stamps.
///
/// Pure arithmetic: no allocation, not thread-safe.
class ExposureClock {
 public:
  struct Stream {
    std::int64_t frame_period_ns = 0;  ///< 0 if unknown.
    std::int64_t exposure_ns = 0;      ///< 0 if unknown.
    std::int64_t offset_ns = 0;        ///< Added to every time.
    int exposures_per_picture = 1;
    bool is_one_field_a_buffer = false;
    Field first_field = Field::kTop;
  };

  ExposureClock() = default;
  explicit ExposureClock(const Stream& stream) : stream_(stream) {}

  ExposurePlace place(const BufferStamp& stamp) noexcept;

  /// The driver's count starts anew with the next stamp.
  void interrupt() noexcept { is_interrupted_ = true; }

  std::int64_t exposure_period_ns() const noexcept;

 private:
  int later_exposures() const noexcept;  ///< Of a buffer, after its first.
  std::int64_t midpoint(const BufferStamp& stamp) const noexcept;
  std::uint64_t exposures_since(const BufferStamp& stamp, int place_in_frame,
                                std::int64_t midpoint_ns) noexcept;
  std::uint64_t by_time(std::int64_t midpoint_ns, int place_in_frame) const noexcept;

  Stream stream_;
  bool has_last_ = false;
  bool is_interrupted_ = false;
  bool counts_fields_ = false;
  BufferStamp last_stamp_;
  std::uint64_t last_exposure_ = 0;  ///< Counts buffers, gaps included: fields or frames.
  std::int64_t last_midpoint_ns_ = 0;
};

}  // namespace striper::detail::v4l2
