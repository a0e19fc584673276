// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/piece_scatter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace striper::detail {

void PieceScatter::reserve(std::size_t most) {
  scatter_px_.reserve(most);
  backward_.reserve(most);
}

// Of a candidate and those about it, the mean square running along the piece both ways; what lies
// off the line through two others varies half as much again as a position itself. Noise is known:
// of a single candidate what is more than three sigmas of it counts, of a mean what is more than
// it.
void PieceScatter::measure(const StripePieces& pieces) {
  constexpr float kGain = 0.2F;
  constexpr float kPerPosition = 1.0F / 1.5F;
  const std::size_t size = pieces.size();
  constexpr float kBeyondNoise = 9.0F;
  const auto noise = [&](std::size_t i) {
    return pieces.candidate(i).sigma * pieces.candidate(i).sigma;
  };
  const auto off = [&](std::size_t i) {
    const OffLine& line = pieces.off_line(i);
    const float most = std::max(line.near, line.far);
    return kPerPosition * most * most;
  };
  scatter_px_.resize(size);
  backward_.assign(size, 0.0F);
  for (std::size_t i = size; i-- > 0;) {
    backward_[i] += (backward_[i] > 0.0F ? kGain : 1.0F) * (off(i) - backward_[i]);
    const std::int32_t before = pieces.link(i).before;
    if (before >= 0) backward_[static_cast<std::size_t>(before)] = backward_[i];
  }
  for (std::size_t i = 0; i < size; ++i) {
    const std::int32_t before = pieces.link(i).before;
    const float running = before < 0 ? off(i) : scatter_px_[static_cast<std::size_t>(before)];
    scatter_px_[i] = running + kGain * (off(i) - running);
  }
  for (std::size_t i = 0; i < size; ++i) {
    const float own = off(i) > kBeyondNoise * noise(i) ? off(i) : 0.0F;
    const float about = std::max(own, std::max(scatter_px_[i], backward_[i]));
    backward_[i] = std::sqrt(std::max(0.0F, about - noise(i)));
  }
  scatter_px_.swap(backward_);
}

}  // namespace striper::detail
