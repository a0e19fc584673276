// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "stripe/select/evidence/background_pieces.hpp"
#include "stripe/select/evidence/evidence.hpp"
#include "stripe/select/evidence/weighed_candidates.hpp"
#include "stripe/select/piece_traits.hpp"
#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// What the first weighing of its candidates says of a frame: how its stripe looks, how probable
/// the pieces are that a piece goes on from, and what is background.
///
/// 20 ns a candidate. No allocation after the first frame of a size.
class FirstImpression {
 public:
  /// The mean look of what is probably the stripe.
  struct StripeLook {
    float coverage = 0.0F;   // Candidates that are probably the stripe, per scan line.
    float runner_up = 0.0F;  // Part of the scan lines whose second best is probably the stripe.
    float width = 0.0F, height = 0.0F, light = 0.0F, gain = 0.0F;  // Logs.
  };
  /// Of a piece, by what it is joined with and goes on from.
  struct PieceOdds {
    float of_joined = Evidence::kUnknown;  // Best mean log odds of a piece it is joined with,
    float joined = 0.0F;  // and how many candidates of it and them are probably the stripe.
    float before = Evidence::kUnknown;  // Best log odds in the scan line before it begins,
    float after = Evidence::kUnknown;   // and after it ends.
  };

  void reserve(std::size_t most);

  /// @param heights log of each candidate's.
  void sum_up(const StripePieces& pieces, const PieceTraits& traits,
              const std::vector<float>& heights, const WeighedCandidates& first);

  const StripeLook& stripe() const noexcept { return stripe_; }
  const PieceOdds& of_piece(std::size_t piece) const noexcept { return piece_odds_[piece]; }
  const BackgroundPieces& background() const noexcept { return background_; }

 private:
  void sum_up_joined(const StripePieces& pieces, const WeighedCandidates& first);
  void find_stripe(const StripePieces& pieces, const PieceTraits& traits,
                   const WeighedCandidates& first);
  void find_runner_up(const StripePieces& pieces, const WeighedCandidates& first);

  StripeLook stripe_;
  std::vector<PieceOdds> piece_odds_;
  BackgroundPieces background_;
};

}  // namespace striper::detail
