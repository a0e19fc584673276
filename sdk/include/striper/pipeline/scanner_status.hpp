// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <striper/ambient/ambient_status.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/scan/scan_frame.hpp>

namespace striper {

/// Counts since the scanner was made; of a Head since it was, whatever its model and its source.
struct ScannerStatistics {
  std::uint64_t frames = 0;          ///< Given to `process`.
  std::uint64_t scans = 0;           ///< Returned.
  std::uint64_t without_stripe = 0;  ///< Of them, those without any stripe in the image.
  std::uint64_t dark = 0;            ///< Exposures without a laser.
  std::uint64_t unpaired =
      0;  ///< Lit exposures without a scan: no dark neighbour was left that fits.
  /// Frames whose own status is not kOk, that are no image (empty, or pixels that are not 1 or 3
  /// channels of 8 or 16 bits), or that are of another sensor than the model's.
  std::uint64_t refused = 0;
  /// How long the shutter was open for the lit exposures that came, whether they gave a scan or
  /// not: how long a laser that fires with it was on. Frames that never came are not in it.
  double lit_s = 0.0;

  ScannerStatistics& operator+=(const ScannerStatistics& other) noexcept {
    frames += other.frames;
    scans += other.scans;
    without_stripe += other.without_stripe;
    dark += other.dark;
    unpaired += other.unpaired;
    refused += other.refused;
    lit_s += other.lit_s;
    return *this;
  }
};

/// How the source of a scanner is.
enum class SourceState {
  kWaiting,    ///< It is not open yet, or not again.
  kStreaming,  ///< Frames come.
  kSilent,     ///< It is open and has given nothing for a second.
  kPaused,     ///< It is closed, as somebody wanted.
  kEnded,
};

/// `waiting`, `streaming`, `silent`, `paused` or `ended`.
std::string_view to_string(SourceState state) noexcept;

/// The one form of how a scanner stands; programs make their sentences of it.
struct ScannerStatus {
  std::string head{kDefaultHead};  ///< Whose it is.
  SourceState source = SourceState::kStreaming;
  AmbientStatus ambient;
  StripeAxis axis = StripeAxis::kColumns;
  bool is_stripe_seen = false;  ///< In the last scan.
  ScannerStatistics counts;
};

}  // namespace striper
