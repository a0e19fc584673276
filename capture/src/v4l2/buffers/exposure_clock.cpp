// SPDX-License-Identifier: Apache-2.0
#include "v4l2/buffers/exposure_clock.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail::v4l2 {

std::int64_t ExposureClock::exposure_period_ns() const noexcept {
  return stream_.frame_period_ns / stream_.exposures_per_picture;
}

int ExposureClock::later_exposures() const noexcept {
  return stream_.is_one_field_a_buffer ? 0 : stream_.exposures_per_picture - 1;
}

std::int64_t ExposureClock::midpoint(const BufferStamp& stamp) const noexcept {
  const std::int64_t period_ns = exposure_period_ns();
  if (stamp.is_start_of_exposure) {
    const std::int64_t length_ns = stream_.exposure_ns > 0 ? stream_.exposure_ns : period_ns;
    return stamp.time_ns + length_ns / 2 + stream_.offset_ns;
  }
  return stamp.time_ns - period_ns / 2 - later_exposures() * period_ns + stream_.offset_ns;
}

// How many exposures after the last one this is, by the clock; at least the next that has its
// place.
std::uint64_t ExposureClock::by_time(std::int64_t midpoint_ns, int place_in_frame) const noexcept {
  const int step = stream_.is_one_field_a_buffer ? stream_.exposures_per_picture : 1;
  const std::int64_t period_ns =
      stream_.is_one_field_a_buffer ? exposure_period_ns() : stream_.frame_period_ns;
  const double elapsed = period_ns > 0 ? static_cast<double>(midpoint_ns - last_midpoint_ns_) /
                                             static_cast<double>(period_ns)
                                       : 1.0;
  const auto last_place = static_cast<int>(last_exposure_ % static_cast<std::uint64_t>(step));
  const int phase = (place_in_frame - last_place + step) % step;
  const double frames = std::round((elapsed - phase) / step);
  const auto exposures = static_cast<std::int64_t>(frames) * step + phase;
  return static_cast<std::uint64_t>(std::max<std::int64_t>(exposures, phase > 0 ? phase : step));
}

std::uint64_t ExposureClock::exposures_since(const BufferStamp& stamp, int place_in_frame,
                                             std::int64_t midpoint_ns) noexcept {
  constexpr std::uint32_t kBackwards = 1U << 31;
  const std::uint32_t counted = stamp.sequence - last_stamp_.sequence;
  if (is_interrupted_ || counted >= kBackwards) return by_time(midpoint_ns, place_in_frame);
  if (!stream_.is_one_field_a_buffer || stream_.exposures_per_picture == 1)
    return std::max<std::uint64_t>(counted, 1);  // Some drivers do not count at all.

  const auto last_place = static_cast<int>(last_exposure_ % 2);
  const bool follows_closely =
      stamp.time_ns - last_stamp_.time_ns < 3 * stream_.frame_period_ns / 4;
  if (counted == 1 && last_place == 0 && place_in_frame == 1 && follows_closely)
    counts_fields_ = true;
  if (counted == 0 && place_in_frame != last_place) counts_fields_ = false;

  const std::int64_t step =
      counts_fields_ ? static_cast<std::int64_t>(counted)
                     : 2 * static_cast<std::int64_t>(counted) + place_in_frame - last_place;
  const bool fits = step > 0 && (step + last_place - place_in_frame) % 2 == 0;
  return fits ? static_cast<std::uint64_t>(step) : by_time(midpoint_ns, place_in_frame);
}

ExposurePlace ExposureClock::place(const BufferStamp& stamp) noexcept {
  const bool has_places = stream_.is_one_field_a_buffer && stream_.exposures_per_picture == 2;
  const int place_in_frame = has_places && stamp.field != stream_.first_field ? 1 : 0;
  std::int64_t midpoint_ns = midpoint(stamp);
  const std::int64_t began_ns = midpoint_ns - exposure_period_ns() / 2;
  std::uint64_t step = 0;
  if (has_last_) {
    step = exposures_since(stamp, place_in_frame, midpoint_ns);
    midpoint_ns =
        std::max(midpoint_ns, last_midpoint_ns_ + later_exposures() * exposure_period_ns() + 1);
  }
  // A stream that begins with the second field of a frame keeps that place.
  last_exposure_ = has_last_ ? last_exposure_ + step : static_cast<std::uint64_t>(place_in_frame);
  const std::uint64_t lost = step > 1 ? step - 1 : 0;

  has_last_ = true;
  is_interrupted_ = false;
  last_stamp_ = stamp;
  last_midpoint_ns_ = midpoint_ns;
  const std::uint64_t per_frame = has_places ? 2 : 1;
  return {last_exposure_ / per_frame, place_in_frame, midpoint_ns, began_ns,
          (lost + per_frame - 1) / per_frame};
}

}  // namespace striper::detail::v4l2
