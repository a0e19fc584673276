// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <striper/core/illumination_pattern.hpp>
#include <striper/core/lit_frame.hpp>
#include <striper/stripe/stripe.hpp>

namespace striper::detail {

/// What a laser showed in one round of an exposure bracket, as one stripe.
struct BracketedStripe {
  Stripe stripe;
  LitFrame first;  ///< The first exposure, without its pixels; `time` is the middle of all.
};

/// Makes one stripe of those that a bracket's exposures show (IlluminationPattern::is_bracket).
///
/// Of each scan line the return with the smallest error bar is taken: bright surfaces from the
/// short exposure, dark ones from the long. It is not a mean: what the exposures have in common
/// (speckle, the surface itself) is no smaller in it. Good goes before doubtful, doubtful before
/// none, and of good ones what is whole before what is clipped, whose error bar knows its
/// flanks and ends alone. Amplitudes are put at the length of the laser's first exposure in the
/// pattern. Where good returns are two things, farther apart than five times their error and two
/// widths, the return is kAmbiguous.
///
/// An exposure that was lost is left out. No allocation after the first rounds. Not thread-safe.
class StripeBracket {
 public:
  /// @param pattern a bracket.
  explicit StripeBracket(const IlluminationPattern& pattern);

  /// Which of the laser's exposures in a round this one is, from 0 on.
  std::size_t place_of(const LitFrame& lit) const noexcept;

  /// Takes the stripe of an exposure. `ready` has what is complete: the round before, where this is
  /// the first exposure of another, then its own where it is the last. Valid until the next call.
  void add(const LitFrame& lit, const Stripe& stripe);

  /// What is left at the end of the stream, in `ready`.
  void finish();

  const std::vector<const BracketedStripe*>& ready() const noexcept { return ready_; }

 private:
  // Of one laser.
  struct Round {
    std::vector<std::size_t> entries;   // Of the pattern, those that it lights.
    std::uint64_t number = 0;           // Of the pattern, since the first.
    std::size_t taken = 0;              // Exposures; 0: none is open.
    std::int64_t sum_ns = 0;            // Of their times after the first.
    std::vector<std::uint8_t> clipped;  // Of the open one's scan lines: taken from a clipped peak.
    BracketedStripe open;
    std::array<BracketedStripe, 2> done;  // What `ready` points to: the round before, and this.
  };

  static void merge(const LitFrame& lit, const Stripe& stripe, double amplitude_factor,
                    Round& round);
  void close(Round& round);

  IlluminationPattern pattern_;
  std::vector<Round> rounds_;  // By laser.
  std::vector<const BracketedStripe*> ready_;
};

}  // namespace striper::detail
