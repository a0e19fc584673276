// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/evidence/first_impression.hpp"

#include <algorithm>

namespace striper::detail {

void FirstImpression::reserve(std::size_t most) {
  piece_odds_.reserve(most);
  background_.reserve(most);
}

void FirstImpression::sum_up(const StripePieces& pieces, const PieceTraits& traits,
                             const std::vector<float>& heights, const WeighedCandidates& first) {
  sum_up_joined(pieces, first);
  stripe_ = StripeLook{};
  find_stripe(pieces, traits, first);
  find_runner_up(pieces, first);
  background_.sum_up(pieces, heights, first.odds());
}

// Along the pieces that a straight line joins: forward, then back, so that each knows of all.
void FirstImpression::sum_up_joined(const StripePieces& pieces, const WeighedCandidates& first) {
  piece_odds_.assign(pieces.pieces().size(), PieceOdds{});
  for (std::size_t p = 0; p < piece_odds_.size(); ++p) {
    const Piece& piece = pieces.pieces()[p];
    piece_odds_[p].before = first.best_of_line(pieces, piece.first_line - 1);
    piece_odds_[p].after = first.best_of_line(pieces, piece.last_line + 1);
  }
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    PieceOdds& odds = piece_odds_[static_cast<std::size_t>(pieces.link(i).piece)];
    odds.joined += logistic(first.odds(i));
  }
  const auto join = [&](std::size_t from, std::size_t to) {
    piece_odds_[to].of_joined = std::max(piece_odds_[to].of_joined, first.of_piece(from));
  };
  const std::size_t size = piece_odds_.size();
  for (std::size_t p = 0; p < size; ++p) {
    if (pieces.pieces()[p].before < 0) continue;
    const auto before = static_cast<std::size_t>(pieces.pieces()[p].before);
    join(before, p);
    join(p, before);
    piece_odds_[p].joined += piece_odds_[before].joined;
  }
  for (std::size_t p = size; p-- > 0;) {
    if (pieces.pieces()[p].before < 0) continue;
    float& before = piece_odds_[static_cast<std::size_t>(pieces.pieces()[p].before)].joined;
    before = std::max(before, piece_odds_[p].joined);
  }
}

void FirstImpression::find_runner_up(const StripePieces& pieces, const WeighedCandidates& first) {
  float sum = 0.0F;
  for (int line = 0; line < pieces.lines(); ++line) {
    float best = Evidence::kUnknown;
    float second = Evidence::kUnknown;
    for (std::size_t i = pieces.first_of(line); i < pieces.first_of(line + 1); ++i) {
      second = std::max(second, std::min(best, first.odds(i)));
      best = std::max(best, first.odds(i));
    }
    sum += logistic(second);
  }
  stripe_.runner_up = sum / static_cast<float>(std::max(1, pieces.lines()));
}

void FirstImpression::find_stripe(const StripePieces& pieces, const PieceTraits& traits,
                                  const WeighedCandidates& first) {
  float sum = 0.0F;
  float widths = 0.0F;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (first.odds(i) < 0.0F || first.odds(i) < first.rival(i)) continue;
    const Candidate& c = pieces.candidate(i);
    const PieceTraits::Look& look = traits.of_candidate(i);
    const float share = logistic(first.odds(i));
    sum += share;
    stripe_.height += share * look.height;
    stripe_.light += share * look.light;
    stripe_.gain += share * look.gain;
    if (c.is_clipped) continue;
    stripe_.width += share * fast_log2(traits.width_of(c));
    widths += share;
  }
  if (widths > 0.0F) stripe_.width /= widths;
  stripe_.coverage = sum / static_cast<float>(std::max(1, pieces.lines()));
  if (!(sum > 0.0F)) return;
  for (float* mean : {&stripe_.height, &stripe_.light, &stripe_.gain}) *mean /= sum;
}

}  // namespace striper::detail
