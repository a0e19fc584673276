// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// Of each candidate the mean of a value over those before and after it in its piece, itself left
/// out: running means of both sides, over about five candidates each.
///
/// 4 ns a candidate. No allocation after the first frame of a size.
class MeanAbout {
 public:
  void reserve(std::size_t most);

  /// @param values one for each candidate. @param none for a candidate that is alone.
  void find(const StripePieces& pieces, const std::vector<float>& values, float none,
            std::vector<float>& means);

 private:
  // Of those on the one side of a candidate.
  struct Side {
    float mean = 0.0F;
    bool any = false;

    Side followed_by(float value) const;
  };
  std::vector<Side> before_, after_;
};

}  // namespace striper::detail
