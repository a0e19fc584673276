// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace striper::detail {

struct PaintEndsOptions {
  double least_paint_m = 0.15;  ///< What is shorter is a raised marker or a spot.
  double least_gap_m = 0.3;     ///< What is shorter is a hole.
};

/// What one look at the road along a line tells of where its paint begins and ends.
struct PaintLook {
  enum class News { kNothing, kBegin, kPaint, kEnd, kShort };
  News news = News::kNothing;
  /// kBegin, kEnd: where. kPaint: seen painted up to here. kShort: where the short thing began.
  double at_m = std::numeric_limits<double>::quiet_NaN();
  double length_m = 0.0;  ///< kShort: of it.
};

/// Finds where the paint of one line begins and ends, as one beam passes over it: halfway between
/// the last look without and the first with, and the other way round. An end is told when it is
/// known to be one, the least lengths later.
class PaintEnds {
 public:
  explicit PaintEnds(const PaintEndsOptions& options) noexcept : options_(options) {}

  /// @param at_m where the beam met the road, growing.
  PaintLook look(bool is_paint, double at_m) noexcept;

  bool is_on_paint() const noexcept { return phase_ == Phase::kPaint || phase_ == Phase::kHole; }

 private:
  enum class Phase {
    kUnknown,
    kBare,
    kMaybePaint,  // Paint that is too short yet.
    kPaint,
    kHole,  // A gap that is too short yet.
  };
  PaintLook begin(double at_m) noexcept;
  PaintLook lose(double at_m) noexcept;

  PaintEndsOptions options_;
  Phase phase_ = Phase::kUnknown;
  double last_m_ = 0.0;  // Of the look before.
  double turn_m_ = 0.0;  // Where the phase began, halfway between two looks.
};

}  // namespace striper::detail
