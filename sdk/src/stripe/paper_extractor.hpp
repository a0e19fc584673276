// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <striper/stripe/extractor.hpp>

namespace striper::detail {

/// The method of Mertz, Kozar, Miller & Thorpe 2002, "From image to distance": in each column the
/// pixel of maximum intensity above a threshold, then the intensity-weighted mean of that pixel and
/// its two neighbours.
///
/// Where the paper is silent: equal maxima side by side (a clipped stripe) count as one, at their
/// middle; the threshold is measured from the local background and, if none is set, is
/// kAutomaticThresholdSigmas times the frame's noise; the error is that of a whole pixel,
/// 1/sqrt(12). Kept as the reference that better methods are compared with: it follows the pixel
/// grid and ignores the background.
class PaperExtractor : public StripeExtractor {
 public:
  explicit PaperExtractor(const ExtractOptions& options) : options_(options) {}

  void extract(const LitFrame& frame, Stripe& stripe) override;

 private:
  template <typename Pixel>
  void extract_lines(const LitFrame& frame, Stripe& stripe);
  template <typename Pixel>
  void find_brightest(const LitFrame& frame);
  template <typename Pixel>
  void measure_line(const LitFrame& frame, int line, double noise_dn, double threshold_dn,
                    Stripe& stripe) const;

  ExtractOptions options_;
  std::vector<std::int32_t>
      brightest_;  // Row of the first maximum of each scan line, -1 if there is none.
  std::vector<std::int32_t> maximum_;     // Its value.
  std::vector<std::uint8_t> any_masked_;  // Non-zero where a scan line has a masked pixel.
  std::vector<std::int32_t> differences_;
};

}  // namespace striper::detail
