// SPDX-License-Identifier: Apache-2.0
#include "guidance/beam/stripe_choice.hpp"

#include <cmath>

namespace striper::detail {
namespace {

// The two of a double line are as far apart as the file says, within this share.
constexpr double kPairTolerance = 0.35;

std::optional<std::size_t> nearest_line(std::span<const SeenPaint> seen, double lateral_m,
                                        double within_m) {
  std::optional<std::size_t> nearest;
  double least_m = within_m;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const double off_m = std::abs(seen[i].lateral_m() - lateral_m);
    if (!seen[i].is_line || off_m > least_m) continue;
    least_m = off_m;
    nearest = i;
  }
  return nearest;
}

struct Cover {
  bool is_hidden = false;
  bool is_worn = false;
};

// What of other shapes lies where a line should be.
Cover cover_of(std::span<const SeenPaint> seen, const GuidanceStripe& stripe, double lateral_m) {
  Cover cover;
  const double half_m = 0.5 * stripe.width_m;
  for (const SeenPaint& paint : seen) {
    const bool is_over = paint.left_m > lateral_m - half_m && paint.right_m < lateral_m + half_m;
    if (paint.is_line || !is_over) continue;
    const bool is_inside =
        paint.left_m < lateral_m + 1.5 * half_m && paint.right_m > lateral_m - 1.5 * half_m;
    (is_inside ? cover.is_worn : cover.is_hidden) = true;
  }
  return cover;
}

// The first pair from the left that is a double line.
std::optional<std::size_t> pair_left(std::span<const SeenPaint> seen, double spacing_m) {
  for (std::size_t i = 0; i < seen.size(); ++i) {
    for (std::size_t k = i + 1; k < seen.size(); ++k) {
      const double apart_m = seen[i].lateral_m() - seen[k].lateral_m();
      if (seen[i].is_line && seen[k].is_line &&
          std::abs(apart_m - spacing_m) <= kPairTolerance * spacing_m) {
        return i;
      }
    }
  }
  return std::nullopt;
}

}  // namespace

StripeFound choose_stripe(std::span<const SeenPaint> seen, const GuidanceStripe& stripe,
                          const ExpectedLine& expected) {
  StripeFound found;
  const double spacing_m = stripe.line_spacing_m();
  const bool is_double = stripe.follow != FollowLine::kSingle;
  const double side_m = stripe.follow == FollowLine::kRight ? spacing_m : -spacing_m;
  double followed_m = expected.lateral_m;
  if (std::isnan(followed_m)) {
    if (is_double) {
      const auto left = pair_left(seen, spacing_m);
      if (!left) return found;
      const double left_m = seen[*left].lateral_m();
      followed_m = stripe.follow == FollowLine::kLeft ? left_m : left_m - spacing_m;
      found.followed = nearest_line(seen, followed_m, kPairTolerance * spacing_m);
    } else {
      found.followed = nearest_line(seen, 0.0, expected.within_m);
    }
    if (!found.followed) return found;
    followed_m = seen[*found.followed].lateral_m();
  } else {
    found.followed = nearest_line(seen, followed_m, expected.within_m);
    const Cover cover = cover_of(seen, stripe, followed_m);
    found.is_followed_hidden = cover.is_hidden;
    found.is_followed_worn = cover.is_worn;
    if (found.followed) followed_m = seen[*found.followed].lateral_m();
  }
  if (!is_double) return found;
  const double other_m = followed_m + side_m;
  found.other = nearest_line(seen, other_m, kPairTolerance * spacing_m);
  if (found.other == found.followed) found.other.reset();
  const Cover cover = cover_of(seen, stripe, other_m);
  found.is_other_hidden = cover.is_hidden;
  found.is_other_worn = cover.is_worn;
  return found;
}

}  // namespace striper::detail
