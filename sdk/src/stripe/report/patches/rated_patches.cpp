// SPDX-License-Identifier: Apache-2.0
#include "stripe/report/patches/rated_patches.hpp"

#include <cmath>

namespace striper::detail {
namespace {

// Log odds. What is less probable is not the stripe, and what is more probable is.
constexpr float kLeastDoubted = -2.0F;
constexpr float kMostDoubted = 7.0F;
// A patch serves returns that are no farther away, scan lines and pixels: it learnt of such.
constexpr std::size_t kServedAlong = 4;
constexpr double kServedAcross_px = 3.0;

}  // namespace

bool RatedPatches::is_doubted(float log_odds) noexcept {
  return log_odds > kLeastDoubted && log_odds < kMostDoubted;
}

bool RatedPatches::serves(std::size_t line) const noexcept {
  if (about_ == kNone || line - about_ > kServedAlong) return false;
  return std::abs(rated_.position(line) - rated_.position(about_)) <= kServedAcross_px;
}

bool RatedPatches::look_at(std::size_t line) noexcept {
  line_ = line;
  if (serves(line)) return false;
  about_ = line;
  look_about(rated_, line, patch_);
  PatchNet::look(patch_, seen_);
  return true;
}

PatchNet::Place RatedPatches::place() const noexcept {
  const double about = rated_.position(about_);
  return {static_cast<float>(line_ - about_), static_cast<float>(rated_.position(line_) - about),
          static_cast<float>(about - std::rint(about))};
}

float RatedPatches::more_log_odds(const Evidence& evidence) const noexcept {
  return PatchNet::more_log_odds(seen_, place(), evidence, rated_.odds[line_]);
}

}  // namespace striper::detail
