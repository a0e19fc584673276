// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <striper/core/return_status.hpp>

#include "core/left_blank.hpp"
#include "stripe/profile/profile_kernel.hpp"

namespace striper::detail {

/// Peaks that may be the stripe: parallel arrays, one element per seed. First as the kernel
/// measures them, in pixels of the image; `judge_peaks` then makes of them what is reported.
struct PeakList {
  std::vector<PeakSeed> seeds;
  BlankVector<std::int32_t> across;
  BlankVector<float> offset, amplitude, width, sigma, significance, snr, clipped, level, slope;

  BlankVector<float> confidence;
  BlankVector<ReturnStatus> status;

  std::size_t size() const noexcept { return seeds.size(); }

  /// Across the stripe, pixels of the image.
  double position(std::size_t i) const noexcept {
    return across[i] + static_cast<double>(offset[i]);
  }

  /// Makes room for the measurements of so many seeds; no allocation once there was as much.
  void make_room(std::size_t count);

  /// What `measure_profiles` writes to. Valid until the next `make_room`.
  PeakMeasurements measurements() noexcept;

  /// Takes what was measured of element n of another list.
  void take(std::size_t i, const PeakList& from, std::size_t n) noexcept;

  /// Makes nothing of an element: it is no peak.
  void blank(std::size_t i) noexcept {
    significance[i] = snr[i] = amplitude[i] = clipped[i] = 0.0F;
  }
};

}  // namespace striper::detail
