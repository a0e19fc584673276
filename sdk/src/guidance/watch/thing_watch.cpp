// SPDX-License-Identifier: Apache-2.0
#include "guidance/watch/thing_watch.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

constexpr std::size_t kMostOpen = 32;
// What is not seen for so long is passed by.
constexpr double kPassed_m = 0.25;
// Pieces of one thing lie so near each other across the road.
constexpr double kBeside_m = 0.06;
// A housing's prisms and tape send back some times what worn beads do; fresh beads, twice.
constexpr double kMarkerBright = 1.6;
// A tape is a foot long; what is bright for longer is the stripe itself.
constexpr double kLongestBright_m = 0.5;
// A raised marker is four inches wide; a letter's stroke and a cross are wider or longer.
constexpr double kMarkerWidth_m = 0.16;
constexpr double kLetterLength_m = 0.6;
constexpr double kSpotSize_m = 0.45;
constexpr double kCrossWidths = 2.5;

double height_share(double now, double mean) { return mean > 0.0 ? now / mean : 1.0; }

}  // namespace

ThingWatch::ThingWatch(BeamKind kind, const GuidanceStripe& stripe) : kind_(kind), stripe_(stripe) {
  open_.reserve(kMostOpen);
}

bool ThingWatch::is_marker(double height, double at_m) noexcept {
  const bool is_bright =
      kind_ == BeamKind::kRetro && stripe_height_ > 0.0 && height > kMarkerBright * stripe_height_;
  if (!is_bright) return false;
  if (!(at_m - bright_to_m_ < kPassed_m)) bright_from_m_ = at_m;
  bright_to_m_ = at_m;
  if (at_m - bright_from_m_ <= kLongestBright_m) return true;
  stripe_height_ = height;
  return false;
}

void ThingWatch::see_stripe(double height) noexcept {
  constexpr double kShare = 0.02;
  stripe_height_ += (stripe_height_ > 0.0 ? kShare : 1.0) * (height - stripe_height_);
}

void ThingWatch::see(const SeenPaint& paint, double stripe_lateral_m, double at_m,
                     double spacing_m) {
  const double brightness = height_share(paint.height, stripe_height_);
  for (Open& open : open_) {
    RoadThing& thing = open.thing;
    if (paint.right_m > thing.left_m + kBeside_m || paint.left_m < thing.right_m - kBeside_m) {
      continue;
    }
    thing.to_m = at_m;
    thing.left_m = std::max(thing.left_m, paint.left_m);
    thing.right_m = std::min(thing.right_m, paint.right_m);
    open.widest_m = std::max(open.widest_m, paint.width_m());
    open.brightest = std::max(open.brightest, brightness);
    ++open.sweeps;
    return;
  }
  if (open_.size() == kMostOpen) return;
  Open open;
  open.thing.from_m = open.thing.to_m = at_m;
  open.thing.left_m = paint.left_m;
  open.thing.right_m = paint.right_m;
  open.widest_m = paint.width_m();
  open.brightest = brightness;
  open.spacing_m = spacing_m;
  open.stripe_m = stripe_lateral_m;
  open.sweeps = 1;
  open_.push_back(open);
}

void ThingWatch::classify(Open& open) const noexcept {
  RoadThing& thing = open.thing;
  thing.brightness = open.brightest;
  const double length_m = thing.length_m();
  const double across_m = thing.left_m - thing.right_m;
  const bool is_bright = kind_ == BeamKind::kRetro && open.brightest > kMarkerBright;
  const bool is_short = length_m <= stripe_.marker_max_m;
  const bool is_on_stripe = thing.left_m > open.stripe_m - 0.5 * stripe_.width_m &&
                            thing.right_m < open.stripe_m + 0.5 * stripe_.width_m;
  const auto is = [&](SeenKind kind, std::string_view reason) {
    thing.kind = kind;
    thing.reason = reason;
  };
  if (is_short && across_m <= kMarkerWidth_m && (is_bright || kind_ == BeamKind::kDiffuse)) {
    is(SeenKind::kMarker, "short along the road, brighter than paint");
  } else if (is_bright && across_m <= 2.0 * stripe_.width_m) {
    is(SeenKind::kTape, "brighter than paint, longer than a marker");
  } else if (is_on_stripe && across_m >= kCrossWidths * stripe_.width_m) {
    is(SeenKind::kCross, "wide, across the stripe");
  } else if (length_m >= kLetterLength_m || across_m >= kLetterLength_m) {
    is(SeenKind::kLetter, "long or wide, beside the stripe");
  } else if (length_m <= kSpotSize_m && across_m <= kSpotSize_m) {
    is(SeenKind::kSpot, "small, as bright as paint");
  } else {
    is(SeenKind::kTape, "narrow and long");
  }
}

std::optional<RoadThing> ThingWatch::take(double at_m) {
  const auto passed = std::find_if(open_.begin(), open_.end(), [&](const Open& open) {
    return at_m - open.thing.to_m > kPassed_m;
  });
  if (passed == open_.end()) return {};
  // It reaches half a sweep beyond the sweeps that saw it.
  passed->thing.from_m -= 0.5 * passed->spacing_m;
  passed->thing.to_m += 0.5 * passed->spacing_m;
  classify(*passed);
  const RoadThing thing = passed->thing;
  open_.erase(passed);
  return thing;
}

}  // namespace striper::detail
