// SPDX-License-Identifier: Apache-2.0
#include "guidance/dashes/paint_ends.hpp"

namespace striper::detail {
namespace {

// Over more than this without a look nobody knows whether the paint goes on.
constexpr double kLongestUnseen_m = 1.0;

}  // namespace

using News = PaintLook::News;

PaintLook PaintEnds::begin(double at_m) noexcept {
  phase_ = Phase::kPaint;
  return {News::kBegin, at_m, 0.0};
}

// What was paint ends where it was seen last.
PaintLook PaintEnds::lose(double at_m) noexcept {
  const bool was_on_paint = is_on_paint();
  const double seen_m = phase_ == Phase::kHole ? turn_m_ : last_m_;
  phase_ = Phase::kUnknown;
  last_m_ = at_m;
  return was_on_paint ? PaintLook{News::kEnd, seen_m, 0.0} : PaintLook{};
}

PaintLook PaintEnds::look(bool is_paint, double at_m) noexcept {
  if (phase_ != Phase::kUnknown && at_m - last_m_ > kLongestUnseen_m) return lose(at_m);
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
