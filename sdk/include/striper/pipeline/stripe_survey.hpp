// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <striper/core/channel.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/pipeline/scanner.hpp>

namespace striper {

/// One way to look for the stripe, and how much of it was seen in that way.
struct StripeSighting {
  StripeAxis axis = StripeAxis::kColumns;
  Channel channel = Channel::kGrey;
  std::uint64_t scans = 0;       ///< Lit exposures that were looked at.
  std::uint64_t scans_seen = 0;  ///< Of them, those with a stripe (`PolarScan::is_stripe_seen`).
  double found =
      0.0;  ///< Part of the scan lines of those scans whose return is kOk; 0 without any.

  /// At least half of the exposures show a stripe.
  bool is_seen() const noexcept { return scans_seen > 0 && 2 * scans_seen >= scans; }
};

/// Looks for a stripe along both axes in every channel, for images in which none was found as
/// they were scanned.
///
/// Each of the two axes with each channel (of grey images one, of colour images grey, red,
/// green, blue and their two differences) gets a Scanner of its own, without a model: what the
/// model knows of place, width and colour does not limit the search.
///
/// @param frames a few of a stream, in order; with dark exposures enough to subtract them: three.
///        Frames that a Scanner refuses count for nothing.
/// @param options as the stream is scanned; axis, channel and expected stripes are replaced. The
///        pattern, where it is given, says which frames are dark; else all count as lit.
/// @return every way that was tried, the one with the largest `found` first; empty without frames.
/// @throws Error as Scanner's constructor does. Costs a scan of each frame, up to twelve times;
///         allocates. Thread-safe: it shares nothing.
std::vector<StripeSighting> survey_stripes(std::span<const Frame> frames,
                                           const ScannerOptions& options);

}  // namespace striper
