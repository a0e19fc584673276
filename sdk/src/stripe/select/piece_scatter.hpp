// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// By how much each candidate's position is off beyond its own sigma, as it lies beside its piece:
/// pixels, one sigma. What the texture of a surface does to a stripe, and the curve of one.
///
/// The mean square of what a candidate and those about it lie off the line, running along the piece
/// both ways. 10 ns a candidate. No allocation after the first frame of a size.
class PieceScatter {
 public:
  void reserve(std::size_t most);

  /// Precondition: `pieces.measure_off_line()`.
  void measure(const StripePieces& pieces);

  /// None of any candidate.
  void clear(const StripePieces& pieces) { scatter_px_.assign(pieces.size(), 0.0F); }

  /// Of each candidate.
  const std::vector<float>& px() const noexcept { return scatter_px_; }

 private:
  std::vector<float> scatter_px_, backward_;
};

}  // namespace striper::detail
