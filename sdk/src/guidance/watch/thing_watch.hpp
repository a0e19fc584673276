// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include <striper/guidance/guidance_config.hpp>
#include <striper/guidance/guidance_csv.hpp>

#include "guidance/beam/beam_reader.hpp"

namespace striper::detail {

/// Something on the road that is not the stripe, passed over.
struct RoadThing {
  SeenKind kind = SeenKind::kSpot;
  double from_m = 0.0;
  double to_m = 0.0;
  double left_m = 0.0;
  double right_m = 0.0;
  double brightness = 0.0;  ///< Height beside that of the stripe.
  std::string_view reason;  ///< Static storage.

  double length_m() const noexcept { return to_m - from_m; }
  double lateral_m() const noexcept { return 0.5 * (left_m + right_m); }
};

/// Puts together, sweep by sweep of one beam, what is seen beside the stripe, and tells what it is
/// by its length along the road, its width across and its brightness beside the stripe's.
class ThingWatch {
 public:
  ThingWatch(BeamKind kind, const GuidanceStripe& stripe);

  /// A sweep's paint that is not the stripe. @param stripe_lateral_m where that is; may be NaN.
  /// @param at_m where the beam met the road; @param spacing_m from the sweep before.
  void see(const SeenPaint& paint, double stripe_lateral_m, double at_m, double spacing_m);
  /// How high the stripe itself was.
  void see_stripe(double height) noexcept;

  /// Things that are passed by, one a call. @param at_m where the beam is by now.
  std::optional<RoadThing> take(double at_m);

  double stripe_height() const noexcept { return stripe_height_; }
  /// Whether what lies where the stripe should be is a marker or a tape: brighter than its paint
  /// can be, and not for long. What stays bright is paint that is less worn, or dry again.
  bool is_marker(double height, double at_m) noexcept;

 private:
  struct Open {
    RoadThing thing;
    double widest_m = 0.0;
    double brightest = 0.0;
    double spacing_m = 0.0;
    double stripe_m = 0.0;
    int sweeps = 0;
  };
  void classify(Open& open) const noexcept;

  BeamKind kind_;
  GuidanceStripe stripe_;
  double stripe_height_ = 0.0;
  double bright_from_m_ = std::numeric_limits<double>::quiet_NaN();
  double bright_to_m_ = 0.0;
  std::vector<Open> open_;
};

}  // namespace striper::detail
