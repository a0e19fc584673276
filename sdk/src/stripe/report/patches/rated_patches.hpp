// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>

#include "stripe/report/patches/patch_net.hpp"
#include "stripe/report/patches/return_patch.hpp"

namespace striper::detail {

/// Looks at the image about the returns of a frame, one after the other. What a patch shows serves
/// those next to the one that it was made about.
///
/// No allocation.
class RatedPatches {
 public:
  /// @param rated is used as long as this is.
  explicit RatedPatches(const RatedFrame& rated) : rated_(rated) {}

  /// Whether a return that was rated so is looked at: what is certain stays so.
  static bool is_doubted(float log_odds) noexcept;

  /// Goes on to a scan line's return. Returns whether that took a new patch.
  bool look_at(std::size_t line) noexcept;

  /// After `look_at`, what the image says of that return: what is to be added to its log odds.
  float more_log_odds(const Evidence& evidence) const noexcept;

  /// The same, for whoever fits the network: the patch, and where the return is in it.
  const ReturnPatch& patch() const noexcept { return patch_; }
  PatchNet::Place place() const noexcept;

 private:
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

  bool serves(std::size_t line) const noexcept;

  RatedFrame rated_;
  ReturnPatch patch_{};
  PatchNet::Seen seen_{};
  std::size_t about_ = kNone;  // The scan line of the patch,
  std::size_t line_ = kNone;   // and that which is looked at.
};

}  // namespace striper::detail
