// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include <striper/stripe/extractor.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/candidates/searched_part.hpp"
#include "stripe/edges/edge_profile.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// Measures scan lines that cannot tell by themselves, where sure returns on both sides lie on a
/// straight line: what their line says is fitted together with an edge of reflectance.
///
/// A stripe a few pixels beside the edge of a much brighter surface is no peak, but a shoulder of
/// the edge: no candidate is there, or one that the edge has drawn aside. Where the fit is good,
/// the light is far more than noise makes, and it is where the line says, the scan line gets that
/// return. On a surface that is not flat, or of which the line passes by, no light is there.
///
/// Limits: a strip as narrow as the stripe that lies on its line, beside a surface four times as
/// bright as what is on its other side, is taken for it: one image does not tell them apart.
///
/// Frames whose background is subtracted have no need of it. No allocation after the first frame.
class BridgedGaps {
 public:
  /// That what is measured is the stripe: the lower end of what simulated rooms and boards show.
  static constexpr float kConfidence = 0.993F;

  struct Measured {
    const FrameAtHand& at_hand;
    const SearchedPart& part;
    const WidthModel& width;  ///< Effective.
    double excess_sigma_px;   ///< That every return has, sensor pixels,
    double least_dn;          ///< and what each must rise, DN
    double least_snr;         ///< and noises.
  };

  /// After `begin`. @param stripe of this frame, one return a scan line, errors and all.
  void measure(const Measured& frame, Stripe& stripe);

  /// Begins a frame of so many scan lines, of which none is measured yet.
  void begin(std::size_t lines);

  /// Whether the return of a scan line of the last frame was measured so.
  bool has(int line) const noexcept {
    return std::binary_search(lines_.begin(), lines_.end(), line);
  }

 private:
  // A return that is the stripe for sure. Pixels of the image.
  struct Sure {
    int line;
    double position, sigma, amplitude;
  };
  // Where the stripe of a scan line should be.
  struct Expected {
    double position, sigma;
    double amplitude, most_amplitude;  // Of the sure returns, on the mean and at most.
  };
  void find_sure(const Stripe& stripe);
  std::span<const Sure> about(int line) const;
  std::optional<Expected> expected_at(int line) const;
  static std::optional<EdgeEstimate> fit(const Measured& frame, double width, int line,
                                         const Expected& expected);

  std::vector<Sure> sure_;
  std::vector<int> lines_;  // What was measured, in order.
};

}  // namespace striper::detail
