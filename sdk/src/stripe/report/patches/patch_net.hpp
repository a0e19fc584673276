// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "stripe/report/patches/return_patch.hpp"
#include "stripe/select/evidence/evidence.hpp"

namespace striper::detail {

/// A small convolutional network that tells from the image about a return whether it is right.
///
/// Three layers of 3x3 filters, each halved by the maximum of two by two, see the patch (LeCun et
/// al. 1998); what they say of it is weighed with what else is known of a return. Made by
/// tests/bench/fit_patches.py.
struct PatchNet {
  static constexpr std::size_t kSeen = 32;
  /// What a patch shows.
  using Seen = std::array<float, kSeen>;

  /// A return in its patch.
  struct Place {
    float along;     ///< Scan lines from the one that the patch was made about,
    float across;    ///< pixels from its return,
    float fraction;  ///< and what that one's position is more than a whole pixel.
  };

  /// 670 000 multiplications: 30 us. No allocation.
  static void look(const ReturnPatch& patch, Seen& seen) noexcept;

  /// What is to be added to a return's log odds. 1 us. @param evidence all of it.
  static float more_log_odds(const Seen& seen, const Place& place, const Evidence& evidence,
                             float log_odds) noexcept;
};

}  // namespace striper::detail
