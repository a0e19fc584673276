// SPDX-License-Identifier: Apache-2.0
#include "guidance/dashes/paint_ends.hpp"

namespace striper::detail {

using News = PaintLook::News;

PaintLook PaintEnds::begin(double at_m) noexcept {
  phase_ = Phase::kPaint;
  return {News::kBegin, at_m, 0.0};
}

PaintLook PaintEnds::look(bool is_paint, double at_m) noexcept {
  const double between_m = 0.5 * (last_m_ + at_m);
  last_m_ = at_m;
  switch (phase_) {
    case Phase::kUnknown:
      if (is_paint) return begin(at_m);  // It has begun before; nothing is known of where.
      phase_ = Phase::kBare;
      return {};
    case Phase::kBare:
      if (!is_paint) return {};
      phase_ = Phase::kMaybePaint;
      turn_m_ = between_m;
      [[fallthrough]];
    case Phase::kMaybePaint:
      if (!is_paint) {
        phase_ = Phase::kBare;
        return {News::kShort, turn_m_, between_m - turn_m_};
      }
      return at_m - turn_m_ >= options_.least_paint_m ? begin(turn_m_) : PaintLook{};
    case Phase::kPaint:
      if (is_paint) return {News::kPaint, at_m, 0.0};
      phase_ = Phase::kHole;
      turn_m_ = between_m;
      [[fallthrough]];
    case Phase::kHole:
      if (is_paint) {
        phase_ = Phase::kPaint;
        return {News::kPaint, at_m, 0.0};
      }
      if (at_m - turn_m_ < options_.least_gap_m) return {};
      phase_ = Phase::kBare;
      return {News::kEnd, turn_m_, 0.0};
  }
  return {};
}

}  // namespace striper::detail
