// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/paint_gun.hpp>

namespace striper {
namespace {

constexpr double kLongestDelay_s = 2.0;  // Valves take milliseconds.
constexpr double kBack_m = 0.05;         // A truck that rolls back by more paints no more.
constexpr double kLongest_m = 100.0;     // Dashes are a tenth of it.

bool is_up_to(double most, double value) { return value >= 0.0 && value <= most; }

}  // namespace

void PaintGunOptions::validate() const {
  require_value(std::isfinite(x_m), "PaintGunOptions::x_m", x_m, "a number");
  require_value(is_up_to(kLongestDelay_s, on_delay_s), "PaintGunOptions::on_delay_s", on_delay_s,
                "0 to 2 s");
  require_value(is_up_to(kLongestDelay_s, off_delay_s), "PaintGunOptions::off_delay_s", off_delay_s,
                "0 to 2 s");
  require_value(std::isfinite(on_advance_m), "PaintGunOptions::on_advance_m", on_advance_m,
                "a number");
  require_value(std::isfinite(off_advance_m), "PaintGunOptions::off_advance_m", off_advance_m,
                "a number");
  require_value(is_up_to(kLongest_m, end_extension_m), "PaintGunOptions::end_extension_m",
                end_extension_m, "0 to 100 m");
  require_value(is_up_to(kLongest_m, dash_min_m), "PaintGunOptions::dash_min_m", dash_min_m,
                "0 to 100 m");
  require_value(is_up_to(kLongest_m, gap_min_m), "PaintGunOptions::gap_min_m", gap_min_m,
                "0 to 100 m");
  require_value(dashes >= 1, "PaintGunOptions::dashes", static_cast<double>(dashes), "1 or more");
}

PaintGun::PaintGun(const PaintGunOptions& options) : options_(options) {
  options_.validate();
  ring_.resize(options_.dashes);
}

bool PaintGun::begin_dash(double at_m) noexcept {
  if (!std::isfinite(at_m)) return false;
  if (size_ > 0 && at_m - dash(size_ - 1).to_m < options_.gap_min_m) {
    Dash& last = dash(size_ - 1);
    last.to_m = std::max(last.to_m, at_m);
    last.is_ended = false;
    return true;
  }
  if (size_ > 0) dash(size_ - 1).is_ended = true;  // Its end was not seen.
  if (size_ == ring_.size()) {
    ++lost_;
    return false;
  }
  dash(size_++) = {at_m, at_m, false};
  return true;
}

void PaintGun::see_paint(double at_m) noexcept {
  if (size_ == 0 || dash(size_ - 1).is_ended) return;
  Dash& last = dash(size_ - 1);
  if (at_m > last.to_m) last.to_m = at_m;
}

void PaintGun::end_dash(double at_m) noexcept {
  if (size_ == 0 || dash(size_ - 1).is_ended || !std::isfinite(at_m)) return;
  Dash& last = dash(size_ - 1);
  last.to_m = std::max(last.from_m, at_m);  // May be before what was seen of it: by another beam.
  last.is_ended = true;
}

bool PaintGun::move_begin(double at_m, double near_m, double to_m) noexcept {
  for (std::size_t i = is_on_ ? 1 : 0; i < size_; ++i) {
    Dash& one = dash(i);
    if (!(std::abs(one.from_m - at_m) <= near_m) || !(to_m < one.to_m)) continue;
    one.from_m = to_m;
    return true;
  }
  return false;
}

bool PaintGun::move_end(double at_m, double near_m, double to_m) noexcept {
  for (std::size_t i = 0; i < size_; ++i) {
    Dash& one = dash(i);
    if (!one.is_ended || !(std::abs(one.to_m - at_m) <= near_m) || !(to_m > one.from_m)) continue;
    one.to_m = to_m;
    return true;
  }
  return false;
}

bool PaintGun::add_dash(double from_m, double to_m) noexcept {
  if (!(to_m > from_m)) return false;
  if (size_ == ring_.size()) {
    ++lost_;
    return false;
  }
  std::size_t place = size_++;
  for (; place > 0 && dash(place - 1).from_m > from_m; --place) dash(place) = dash(place - 1);
  dash(place) = {from_m, to_m, true};
  return true;
}

bool PaintGun::wants_on(const Dash& dash, double on_m, double off_m) const noexcept {
  const bool is_long_enough =
      dash.to_m > dash.from_m && dash.to_m - dash.from_m >= options_.dash_min_m;
  const double begin_m = dash.from_m - options_.end_extension_m;
  const bool has_begun = on_m >= (is_on_ ? begin_m - kBack_m : begin_m);
  return is_long_enough && has_begun && off_m < dash.to_m + options_.end_extension_m;
}

bool PaintGun::update(double distance_m, double speed_m_s) noexcept {
  // Where the paint of a signal given now would begin, and end.
  const double on_m =
      distance_m + options_.x_m + options_.on_advance_m + speed_m_s * options_.on_delay_s;
  const double off_m =
      distance_m + options_.x_m + options_.off_advance_m + speed_m_s * options_.off_delay_s;
  if (!std::isfinite(on_m) || !std::isfinite(off_m)) return is_on_ = false;
  while (size_ > 0) {
    const Dash& next = dash(0);
    if (wants_on(next, on_m, off_m)) return is_on_ = true;
    is_on_ = false;
    const bool is_past = off_m >= next.to_m + options_.end_extension_m;
    if (!next.is_ended || !(is_past || next.to_m - next.from_m < options_.dash_min_m)) return false;
    drop_oldest();
  }
  return is_on_ = false;
}

void PaintGun::drop_oldest() noexcept {
  oldest_ = (oldest_ + 1) % ring_.size();
  --size_;
}

void PaintGun::stop() noexcept {
  size_ = 0;
  is_on_ = false;
}

}  // namespace striper
