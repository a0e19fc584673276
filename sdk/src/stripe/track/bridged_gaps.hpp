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

namespace striper::detail {

/// Measures scan lines that cannot tell by themselves, where sure returns about them lie on a
/// straight line: what their line says is fitted together with an edge of reflectance. The returns
/// are those on both sides; where these lie on no line, as at the end of a surface, at least 8 on
/// one side, of which one that was not bridged is at most 8 scan lines away. What was taken is sure
/// for the scan lines about it, in up to 3 passes.
///
/// A stripe a few pixels beside the edge of a much brighter surface is no peak, but a shoulder of
/// the edge: no candidate is there, or one that the edge has drawn aside. What is measured is rated
/// by how well it fits, by the light that is there, by the returns about it, and by what was
/// measured so in the scan lines beside it; what is probable with .995 is taken, whatever
/// confidence was asked for. Where the line passes by the stripe, no light is there.
///
/// Limits: a strip as narrow as the stripe that lies on its line, beside a much brighter surface,
/// is taken for it: one image does not tell them apart.
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
  // A return that is the stripe for sure. Pixels of the image.
  struct Sure {
    int line;
    double position, sigma, amplitude;
    bool is_bridged;  // In a pass before.
  };
  // The nearest on both sides of a scan line, or on one alone.
  struct Beside {
    std::span<const Sure> before, after;

    bool is_one_sided() const { return before.empty() || after.empty(); }
    std::size_t size() const { return before.size() + after.size(); }
    // The nearest on either side; where that has none, on the other.
    const Sure& nearest_before() const { return before.empty() ? after.front() : before.back(); }
    const Sure& nearest_after() const { return after.empty() ? before.back() : after.front(); }
    int lines_to_measured(int line) const;  // To the nearest that was not bridged.
    int lines_spanned() const {
      const Sure& first = before.empty() ? after.front() : before.front();
      const Sure& last = after.empty() ? before.back() : after.back();
      return last.line - first.line + 1;
    }
  };
  // Where the stripe of a scan line should be.
  struct Expected {
    int line;
    Beside by;
    double position, sigma;
    double scatter;  // Chi squared of the sure returns over its degrees of freedom.
    double amplitude, most_amplitude;  // Of the sure returns, on the mean and at most.
  };
  struct Fitted {
    EdgeEstimate estimate;
    double gain;         // By the stripe's light, chi squared.
    double free_off_px;  // How far from the line it is where nothing holds it to the line.
    bool is_held;
  };
  void find_sure(const Stripe& stripe);
  void measure_gaps(const Measured& frame, const Stripe& stripe);
  bool take_sure(double least_probability, Stripe& stripe);
  Beside beside(int line) const;
  static std::optional<Expected> expected_at(int line, const Beside& sure);
  static std::optional<Fitted> fit(const Measured& frame, double width, const Expected& expected);
  std::optional<Bridge> measured_at(const Measured& frame, int line, const Stripe& stripe);
  std::optional<Bridge> measured_by(const Expected& expected, const Measured& frame,
                                    const Stripe& stripe);
  static void take(const Bridge& bridge, double least_probability, Stripe& stripe);
  static void add_fit(const Fitted& fitted, double width, BridgeEvidence& e);
  static void add_line(const Expected& expected, const Fitted& fitted, BridgeEvidence& e);
  static void add_own(const Bridge& bridge, const Stripe& stripe, BridgeEvidence& e);
  void add_beside(std::size_t k);

  std::vector<Sure> sure_;
  std::vector<Bridge> bridges_;
  // Of each scan line: it was measured and had nothing; it is not asked again.
  std::vector<std::uint8_t> is_in_vain_;
};

}  // namespace striper::detail
