// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <striper/stripe/extractor.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/candidates/searched_part.hpp"
#include "stripe/edges/edge_profile.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/profile/profile_plan.hpp"
#include "stripe/track/bridge_rating.hpp"
#include "stripe/track/sure_returns.hpp"

namespace striper::detail {

/// Measures scan lines that cannot tell by themselves, where sure returns about them lie on a
/// straight line: what their line says is fitted together with an edge of reflectance. The line is
/// that of many returns on both sides, on which most of them lie; where there is none, that of the
/// nearest ones on both sides; where these lie on no line, as at the end of a surface, of at least
/// 8 on one side, of which one that was not bridged is at most 8 scan lines away (SureReturns).
/// What was taken is sure for the scan lines about it, in up to 3 passes.
///
/// A stripe a few pixels beside the edge of a much brighter surface is no peak, but a shoulder of
/// the edge: no candidate is there, or one that the edge has drawn aside. What is measured is rated
/// by how well it fits, by the light that is there, by the returns about it, by what was measured
/// so in the scan lines beside it, and by how sure the frame is as a whole; what is probable with
/// .9925, and has enough light or company, is taken, whatever confidence was asked for. Where the
/// line passes by the stripe, no light is there.
///
/// Limits: a strip as narrow as the stripe that lies on its line, beside a much brighter surface,
/// is taken for it: one image does not tell them apart. The stripe of a surface that lies .2 to .4
/// pixels before or behind the line in the gap alone is off by three of the sigmas that are told.
///
/// Frames whose background is subtracted have no need of it. No allocation after the first frame.
class BridgedGaps {
 public:
  struct Measured {
    const FrameAtHand& at_hand;
    const SearchedPart& part;
    const WidthModel& width;   ///< Effective.
    double excess_sigma_px;    ///< That every return has, sensor pixels,
    double least_dn;           ///< and what each must rise, DN
    double least_snr;          ///< and noises.
    double least_probability;  ///< That it is the stripe, to be `ok`.
    /// Of the frame, as PieceTraits has them: how much of it a stripe covers, and what else is
    /// there.
    float coverage, clutter;
  };

  /// What was measured in a scan line, whether it was taken or not. Sensor pixels.
  struct Bridge {
    int line;
    double across_px, sigma_px;
    double amplitude_dn, width_px;
    double off_px = 0.0;  ///< From the line of the sure returns. Pixels of the image.
    BridgeEvidence evidence{};
    float probability = 0.0F;
    bool is_taken = false;
  };

  /// After `begin`. Measures nothing where the stripe is not seen.
  /// @param stripe of this frame, one return a scan line, errors and all.
  void measure(const Measured& frame, Stripe& stripe);

  /// Begins a frame of so many scan lines, of which none is measured yet.
  void begin(std::size_t lines);

  /// Of the last frame, in the order of its scan lines.
  std::span<const Bridge> bridges() const noexcept { return bridges_; }

  /// Whether a scan line's return was measured so, and taken.
  bool has(int line) const noexcept;

 private:
  struct Fitted {
    EdgeEstimate estimate;
    double gain;         // By the stripe's light, chi squared.
    double free_off_px;  // How far from the line it is where little holds it to the line.
  };
  void find_sure(const Stripe& stripe);
  void look_at_frame(const Measured& frame, const Stripe& stripe);
  void measure_gaps(const Measured& frame, const Stripe& stripe);
  bool take_sure(double least_probability, Stripe& stripe);
  static std::optional<Fitted> fit(const Measured& frame, double width,
                                   const ExpectedPlace& expected);
  std::optional<Bridge> measured_at(const Measured& frame, int line, const Stripe& stripe);
  std::optional<Bridge> measured_by(const ExpectedPlace& expected, const Measured& frame,
                                    const Stripe& stripe);
  static void take(const Bridge& bridge, double least_probability, Stripe& stripe);
  static void add_fit(const Fitted& fitted, double width, BridgeEvidence& e);
  static void add_own(const Bridge& bridge, const Stripe& stripe, BridgeEvidence& e);
  void add_beside(std::size_t k);

  SureReturns sure_;
  BridgeEvidence of_frame_{};  // What all of a frame have in common.
  std::vector<Bridge> bridges_;
  // Of each scan line: it was measured and had nothing; it is not asked again.
  std::vector<std::uint8_t> is_in_vain_;
};

}  // namespace striper::detail
