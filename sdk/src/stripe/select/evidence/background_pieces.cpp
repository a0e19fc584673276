// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/evidence/background_pieces.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/select/piece_traits.hpp"

namespace striper::detail {

std::size_t BackgroundPieces::class_of(const Piece& piece) noexcept {
  const float length = 2.0F * fast_log2(static_cast<float>(piece.count));
  return std::min(kLengths - 1, static_cast<std::size_t>(std::max(0.0F, length + 0.1F)));
}

void BackgroundPieces::sum_up(const StripePieces& pieces, const std::vector<float>& heights,
                              const std::vector<float>& odds) {
  doubts_.assign(pieces.pieces().size(), 0.0F);
  float sum = 0.0F;
  float squares = 0.0F;
  float all = 0.0F;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const float doubt = logistic(-odds[i]);
    doubts_[static_cast<std::size_t>(pieces.link(i).piece)] += doubt;
    sum += doubt * heights[i];
    squares += doubt * heights[i] * heights[i];
    all += doubt;
  }
  height_ = all > 0.0F ? sum / all : 0.0F;
  spread_ = all > 0.0F ? std::sqrt(std::max(0.0F, squares / all - height_ * height_)) : 0.0F;
  as_long_.fill(0.0F);
  for (std::size_t p = 0; p < doubts_.size(); ++p) {
    as_long_[class_of(pieces.pieces()[p])] += doubts_[p];
  }
  for (std::size_t k = kLengths; k-- > 0;) as_long_[k] += as_long_[k + 1];
}

float BackgroundPieces::as_long_as(const StripePieces& pieces, std::size_t piece) const noexcept {
  const float others = as_long_[class_of(pieces.pieces()[piece])] - doubts_[piece];
  const auto lines = static_cast<float>(std::max(1, pieces.lines()));
  return fast_log2(1.0F + std::max(0.0F, others) / lines);
}

}  // namespace striper::detail
