// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include <striper/core/return_status.hpp>
#include <striper/profile/resample.hpp>
#include <striper/stream/scan_sink.hpp>

namespace striper {

/// What is done to scans before they are written; in this order.
struct ShapeOptions {
  int average = 1;      ///< Scans that make one (ScanAverager).
  bool smooth = false;  ///< By straight pieces and curves (Smoother).
  std::optional<ResampleGrid> resample;
  std::optional<double> fill_gaps_m;  ///< With `resample`.

  bool is_any() const noexcept { return average > 1 || smooth || resample; }

  /// @throws Error{kUsage} naming what contradicts what.
  void validate() const;
};

/// What was seen on the way; one for several sinks counts all. Thread-safe.
struct ShapeCounts {
  std::atomic<std::uint64_t> still{0};       ///< Returns that were averaged,
  std::atomic<std::uint64_t> moved{0};       ///< and that were refused, because they moved.
  std::atomic<std::uint64_t> incomplete{0};  ///< Means of fewer scans than were asked for.
  std::atomic<std::uint64_t> scans{0};       ///< That the sink was given,
  std::array<std::atomic<std::uint64_t>, kReturnStatusCount> returns{};  ///< and theirs, by status.
};

/// Puts a sink behind averaging, smoothing and resampling: what it hears of are the shaped scans.
/// @param counts  may be null.
/// @throws as ShapeOptions::validate.
std::unique_ptr<ScanSink> shaped_sink(std::unique_ptr<ScanSink> sink, const ShapeOptions& options,
                                      std::shared_ptr<ShapeCounts> counts = nullptr);

}  // namespace striper
