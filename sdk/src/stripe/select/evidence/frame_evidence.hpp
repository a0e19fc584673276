// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stripe/select/evidence/evidence.hpp"
#include "stripe/select/evidence/first_impression.hpp"
#include "stripe/select/evidence/mean_about.hpp"
#include "stripe/select/evidence/weighed_candidates.hpp"
#include "stripe/select/piece_traits.hpp"
#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// The evidence of a frame's candidates, forest by forest: what is seen of each, then what the
/// first forest made of all, then the second.
///
/// A frame goes from `begin` over `hear_first` to `hear_second`, the same one each time. No
/// allocation after the first frame of a size.
class FrameEvidence {
 public:
  /// A frame's candidates as they were looked at. Nothing of it is kept.
  struct Frame {
    const StripePieces& pieces;
    const PieceTraits& traits;
    const ChoiceContext& context;
    const std::vector<float>& scatter_px;  // Of each candidate, beyond its own sigma.
  };

  void reserve(const StripePieces& pieces);

  void begin(const Frame& frame);
  /// @param odds log odds of each candidate, as the first forest weighed it, then the second.
  void hear_first(const Frame& frame, const std::vector<float>& odds);
  void hear_second(const Frame& frame, const std::vector<float>& odds);

  /// What the first forest is asked with; after `hear_first`, the second; after `hear_second`, the
  /// third.
  Evidence for_first(const Frame& frame, std::size_t candidate) const noexcept;
  Evidence for_second(const Frame& frame, std::size_t candidate) const noexcept;
  Evidence for_third(const Frame& frame, std::size_t candidate) const noexcept;

  const WeighedCandidates& first() const noexcept { return first_; }
  const WeighedCandidates& second() const noexcept { return second_; }

 private:
  void add_own(const Frame& frame, std::size_t candidate, Evidence& evidence) const noexcept;
  float level_step(const Frame& frame, std::size_t candidate) const noexcept;
  void add_first(const Frame& frame, std::size_t candidate, Evidence& evidence) const noexcept;
  void add_second(const Frame& frame, std::size_t candidate, Evidence& evidence) const noexcept;

  std::vector<std::int32_t> next_;  // Candidate after each in its piece; -1: none.
  std::vector<float> heights_, heights_near_;
  MeanAbout mean_about_;
  WeighedCandidates first_, second_;
  FirstImpression impression_;
};

}  // namespace striper::detail
