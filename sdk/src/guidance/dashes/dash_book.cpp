// SPDX-License-Identifier: Apache-2.0
#include "guidance/dashes/dash_book.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace striper::detail {
namespace {

// Two beams see one end within this: worn ends of an inch, a sweep each, an odometer's drift.
constexpr double kSameEnd_m = 0.35;
constexpr std::size_t kMostDashes = 64;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

void take(DashEnd& end, double at_m) noexcept {
  end.at_m = (end.at_m * end.beams + at_m) / (end.beams + 1);
  ++end.beams;
}

}  // namespace

DashBook::DashBook(std::size_t beams, const PaintEndsOptions& ends, const GuidanceLine& line,
                   std::vector<PaintGun*> guns)
    : ends_(beams, PaintEnds(ends)),
      pattern_(line),
      guns_(std::move(guns)),
      begun_m_(beams, kUnknown) {
  dashes_.reserve(kMostDashes);
}

PaintLook DashBook::look(std::size_t beam, bool is_paint, double at_m) {
  const PaintLook look = ends_[beam].look(is_paint, at_m);
  switch (look.news) {
    case PaintLook::News::kBegin:
      begin(beam, look.at_m);
      reach(at_m);
      break;
    case PaintLook::News::kPaint:
      reach(at_m);
      break;
    case PaintLook::News::kEnd:
      end(beam, look.at_m);
      break;
    case PaintLook::News::kNothing:
    case PaintLook::News::kShort:
      break;
  }
  return look;
}

DashBook::Dash* DashBook::find_begin(double at_m) noexcept {
  for (Dash& dash : dashes_) {
    if (std::abs(dash.from.at_m - at_m) <= kSameEnd_m) return &dash;
  }
  return nullptr;
}

DashBook::Dash* DashBook::find_end(double at_m) noexcept {
  for (Dash& dash : dashes_) {
    if (dash.is_ended && std::abs(dash.to.at_m - at_m) <= kSameEnd_m) return &dash;
  }
  return nullptr;
}

DashBook::Dash* DashBook::holder(double at_m) noexcept {
  for (Dash& dash : dashes_) {
    if (dash.from.at_m <= at_m && (at_m <= dash.to.at_m || !dash.is_ended)) return &dash;
  }
  return nullptr;
}

void DashBook::begin(std::size_t beam, double at_m) {
  begun_m_[beam] = at_m;
  if (Dash* const same = find_begin(at_m)) {
    const double before_m = same->from.at_m;
    take(same->from, at_m);
    for (PaintGun* gun : guns_) gun->move_begin(before_m, 1e-6, same->from.at_m);
    return;
  }
  if (holder(at_m) != nullptr || dashes_.size() == kMostDashes) return;
  const bool is_newest = dashes_.empty() || at_m > dashes_.back().to.at_m;
  if (!is_newest) return;  // What the first beam has missed is added when it is whole.
  const bool is_allowed = pattern_.expects_begin(at_m);
  dashes_.push_back({{at_m, 1}, {at_m, 0}, false, is_allowed});
  if (!is_allowed) {
    ++unpainted_;
    return;
  }
  is_forgotten_ = false;
  for (PaintGun* gun : guns_) gun->begin_dash(at_m);
}

void DashBook::reach(double at_m) {
  if (dashes_.empty() || dashes_.back().is_ended || at_m <= dashes_.back().to.at_m) return;
  dashes_.back().to.at_m = at_m;
  const bool is_forgotten = std::exchange(is_forgotten_, false);
  if (!dashes_.back().is_allowed) return;
  if (is_forgotten) {
    for (PaintGun* gun : guns_) gun->begin_dash(at_m);
  }
  for (PaintGun* gun : guns_) gun->see_paint(at_m);
}

void DashBook::end(std::size_t beam, double at_m) {
  const double begun_m = std::exchange(begun_m_[beam], kUnknown);
  if (Dash* const same = find_end(at_m)) {
    const double before_m = same->to.at_m;
    take(same->to, at_m);
    for (PaintGun* gun : guns_) gun->move_end(before_m, 1e-6, same->to.at_m);
    return;
  }
  Dash* const open = dashes_.empty() || dashes_.back().is_ended ? nullptr : &dashes_.back();
  if (open != nullptr && at_m > open->from.at_m && beam == 0) {
    open->to = {at_m, 1};
    open->is_ended = true;
    if (!open->is_allowed) return;
    for (PaintGun* gun : guns_) gun->end_dash(at_m);
    return;
  }
  if (open != nullptr && at_m > open->from.at_m && at_m >= open->to.at_m - kSameEnd_m) {
    // The first beam does not see any more: this one's end is the end.
    open->to = {at_m, 1};
    open->is_ended = true;
    if (!open->is_allowed) return;
    for (PaintGun* gun : guns_) gun->end_dash(at_m);
    return;
  }
  const bool is_new = std::isfinite(begun_m) && holder(0.5 * (begun_m + at_m)) == nullptr &&
                      find_begin(begun_m) == nullptr;
  if (!is_new || dashes_.size() == kMostDashes) return;
  const Dash missed{{begun_m, 1}, {at_m, 1}, true, true};
  const auto place = std::find_if(dashes_.begin(), dashes_.end(),
                                  [&](const Dash& dash) { return dash.from.at_m > begun_m; });
  dashes_.insert(place, missed);
  for (PaintGun* gun : guns_) gun->add_dash(begun_m, at_m);
}

std::optional<DashBook::Dash> DashBook::take_before(double at_m) {
  if (dashes_.empty() || !dashes_.front().is_ended || dashes_.front().to.at_m > at_m) return {};
  const Dash first = dashes_.front();
  dashes_.erase(dashes_.begin());
  pattern_.add(first.from.at_m, first.to.at_m);
  return first;
}

}  // namespace striper::detail
