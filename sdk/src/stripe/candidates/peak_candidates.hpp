// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/candidates/block_maxima.hpp"
#include "stripe/candidates/peak_list.hpp"
#include "stripe/candidates/ridges/ridges.hpp"

namespace striper::detail {

/// Which candidates of a frame are worth measuring.
class PeakCandidates {
 public:
  /// The most prominent candidate of every scan line, element i that of scan line i.
  PeakList primary;

  /// What else may be the stripe, in order of scan lines, the more prominent first.
  PeakList secondary;

  /// Chooses them. @param noise_dn of a dark pixel. @param plan says how wide the stripe is.
  void choose(const LitFrame& frame, StripeAxis axis, BlockMaxima& blocks, double noise_dn,
              const ProfilePlan& plan);

  /// Chooses the secondary peaks again of scan lines whose first, however prominent, was measured
  /// to be less significant than that: an edge, say. What rises less may be the stripe. For the
  /// images of the last `choose`, before the secondary peaks are measured.
  void look_behind(float significance, const LitFrame& frame, StripeAxis axis,
                   const BlockMaxima& blocks);

  /// Takes the ridges of every scan line instead of what `choose` found, the highest one first: for
  /// frames whose background hides the stripe.
  void take_ridges(const Ridges& ridges);

  /// How far the ridge of each peak rises, DN; 0: there is none. Of the last `take_ridges`.
  const std::vector<std::int32_t>& primary_rises() const noexcept { return primary_rises_; }
  const std::vector<std::int32_t>& secondary_rises() const noexcept { return secondary_rises_; }

  /// Takes back what was measured of scan lines without a ridge, and of peaks that are much higher
  /// than their ridge: at an edge, noise makes a small one, and a straight background a high peak.
  void blank_false_ridges();

  /// How often the highest candidate of at least that significance is elsewhere than in the scan
  /// line before.
  std::size_t unclear_lines(float significance) const;

  /// Whether a scan line has a peak of at least that significance.
  bool has_peak(int line, float significance) const;

  /// Scan lines without any contrast have a place among the primary peaks and nothing to be
  /// measured: this takes back what was measured.
  void blank_flat_lines();

  /// The first extra of a scan line, or where it would be.
  std::size_t first_secondary(int line) const;

 private:
  void find_hidden_lines(float significance, const BlockMaxima& blocks);
  void find_weak_rivals(const LitFrame& frame, StripeAxis axis, const BlockMaxima& blocks);
  template <typename Pixel>
  void find_weak_rivals_in(const LitFrame& frame, StripeAxis axis, const BlockMaxima& blocks);
  void merge_rivals();
  bool is_hidden(std::int32_t line) const;

  double noise_dn_ = 0.0;
  BlockMaxima::RivalLimits limits_;
  BlockMaxima::Rivals rivals_;
  std::vector<std::int32_t> hidden_;      // Scan lines to look behind their first, in order.
  std::vector<std::int32_t> weak_lines_;  // With them.
  std::vector<std::int32_t> primary_rises_, secondary_rises_;  // Of the ridges, DN; 0: none.
  std::vector<PeakSeed> weak_rivals_;                          // Of the weak scan lines, in order.
};

}  // namespace striper::detail
