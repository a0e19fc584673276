// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/evidence/weighed_candidates.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/select/evidence/evidence.hpp"
#include "stripe/select/piece_traits.hpp"

namespace striper::detail {

void WeighedCandidates::reserve(const StripePieces& pieces) {
  const std::size_t most = pieces.most();
  for (std::vector<float>* some :
       {&odds_, &rivals_, &near_, &near_rivals_, &of_piece_, &rival_of_piece_})
    some->reserve(most);
  mean_about_.reserve(most);
  lines_.reserve(most, pieces.lines());
}

void WeighedCandidates::sum_up(const StripePieces& pieces, const std::vector<float>& odds) {
  odds_ = odds;
  rivals_.assign(pieces.size(), Evidence::kUnknown);
  of_piece_.assign(pieces.pieces().size(), 0.0F);
  rival_of_piece_.assign(pieces.pieces().size(), 0.0F);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const int line = pieces.candidate(i).line;
    for (std::size_t k = pieces.first_of(line); k < pieces.first_of(line + 1); ++k) {
      if (k != i) rivals_[i] = std::max(rivals_[i], odds_[k]);
    }
    const auto p = static_cast<std::size_t>(pieces.link(i).piece);
    of_piece_[p] += odds_[i];
    rival_of_piece_[p] += rivals_[i];
  }
  for (std::size_t p = 0; p < of_piece_.size(); ++p) {
    const auto count = static_cast<float>(pieces.pieces()[p].count);
    of_piece_[p] /= count;
    rival_of_piece_[p] /= count;
  }
  float sum = 0.0F;
  for (int line = 0; line < pieces.lines(); ++line) sum += logistic(best_of_line(pieces, line));
  coverage_ = sum / static_cast<float>(std::max(1, pieces.lines()));
  mean_about_.find(pieces, odds_, Evidence::kUnknown, near_);
  mean_about_.find(pieces, rivals_, Evidence::kUnknown, near_rivals_);
  lines_.find(pieces, odds_, kHopeless);
}

float WeighedCandidates::best_of_line(const StripePieces& pieces, int line) const noexcept {
  if (line < 0 || line >= pieces.lines()) return Evidence::kUnknown;
  float best = Evidence::kUnknown;
  for (std::size_t i = pieces.first_of(line); i < pieces.first_of(line + 1); ++i)
    best = std::max(best, odds_[i]);
  return best;
}

LineSupport::Support WeighedCandidates::lines_of_rivals(const StripePieces& pieces,
                                                        std::size_t candidate) const noexcept {
  constexpr float kSame_px = 3.0F;  // What is nearer is another peak of the same thing.
  const Candidate& c = pieces.candidate(candidate);
  LineSupport::Support best;
  for (std::size_t i = pieces.first_of(c.line); i < pieces.first_of(c.line + 1); ++i) {
    if (std::abs(pieces.candidate(i).across - c.across) < kSame_px) continue;
    best.far = std::max(best.far, lines_.of(i).far);
    best.near = std::max(best.near, lines_.of(i).near);
  }
  return best;
}

}  // namespace striper::detail
