// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/motion/odometer.hpp>

namespace striper {
namespace {

// A count that is shown stands for one length of a count: uniform, variance 1/12. A distance has
// two ends.
constexpr double kVarianceOfDifference = 2.0 / 12.0;
// One or two wrong readings are noise on the line; a counter that was reset stays wrong.
constexpr int kRejectedUntilRestart = 3;
// Readings are called missing from half a period more than usual on.
constexpr double kGapFromPeriods = 1.5;
constexpr std::size_t kLeastHistory = 8;
// A speed is that over this many counts, so that the one at either end is a small part of it; but
// over no more readings than that, so that it is of now.
constexpr std::int64_t kCountsOfSpeed = 4;
constexpr std::size_t kReadingsOfSpeed = 4;
constexpr double kNever_s = -std::numeric_limits<double>::infinity();

}  // namespace

void OdometerOptions::validate() const {
  require_value(std::isfinite(counts_per_m) && counts_per_m != 0.0, "OdometerOptions::counts_per_m",
                counts_per_m, "a number that is not 0");
  require_value(bits == 8 || bits == 16 || bits == 32, "OdometerOptions::bits", bits,
                "8, 16 or 32");
  require_value(max_speed_m_s > 0.0, "OdometerOptions::max_speed_m_s", max_speed_m_s,
                "more than 0");
  require_value(max_acceleration_m_s2 > 0.0, "OdometerOptions::max_acceleration_m_s2",
                max_acceleration_m_s2, "more than 0");
  require_value(stall_s > 0.0, "OdometerOptions::stall_s", stall_s, "more than 0");
  require_value(scale_sigma >= 0.0, "OdometerOptions::scale_sigma", scale_sigma, "0 or more");
  require_value(history >= kLeastHistory, "OdometerOptions::history", static_cast<double>(history),
                "8 or more");
}

Odometer::Odometer(const OdometerOptions& options) : options_(options) {
  options_.validate();
  half_turn_ = std::ldexp(1.0, options_.bits - 1);
  steps_.resize(options_.history);
}

Odometer::Step& Odometer::step(std::size_t back) noexcept {
  return steps_[(newest_ + steps_.size() - back) % steps_.size()];
}
const Odometer::Step& Odometer::step(std::size_t back) const noexcept {
  return steps_[(newest_ + steps_.size() - back) % steps_.size()];
}

// The first knot from there into the past; `size_` where there is none.
std::size_t Odometer::knot_from(std::size_t back) const noexcept {
  while (back < size_ && !step(back).is_knot) ++back;
  return back;
}

OdometerVerdict Odometer::update(const OdometerReading& reading) noexcept {
  if (size_ == 0 && std::isfinite(reading.time_s)) return begin(reading);
  if (!std::isfinite(reading.time_s) || reading.time_s <= seen_s_) {
    ++statistics_.out_of_order;
    return OdometerVerdict::kOutOfOrder;
  }
  const double elapsed_s = reading.time_s - step(0).time_s;
  const double predicted = rate_now() * elapsed_s;
  // Of all distances that show this count, a turn apart, the one nearest to what is predicted. The
  // counts wrap in unsigned arithmetic, as the counter does.
  const auto shown = static_cast<std::uint64_t>(reading.counts);
  const double step_shown = static_cast<double>((shown - static_cast<std::uint64_t>(shown_)) &
                                                ((std::uint64_t{1} << options_.bits) - 1));
  const double turn = 2.0 * half_turn_;
  const double delta = step_shown + turn * std::round((predicted - step_shown) / turn);

  const double per_m = std::abs(options_.counts_per_m);
  const bool is_too_fast = std::abs(delta) > per_m * options_.max_speed_m_s * elapsed_s + 1.0;
  const bool is_sudden = is_speed_known_ && std::abs(delta - predicted) > sudden_counts(elapsed_s);
  if (is_too_fast || is_sudden) return reject(reading);
  return take(reading, static_cast<std::int64_t>(delta));
}

// How many counts more or less than predicted can come: the speed that predicts is an average over
// some time, and counts are whole at both ends of both.
double Odometer::sudden_counts(double elapsed_s) const noexcept {
  const std::size_t older = window_from(knot_from(0));
  double speed_over_s = elapsed_s;
  if (older < size_) speed_over_s = step(0).time_s - step(older).time_s;
  const double change = std::abs(options_.counts_per_m) * options_.max_acceleration_m_s2;
  return change * elapsed_s * (elapsed_s + speed_over_s) + 2.0 * (1.0 + elapsed_s / speed_over_s);
}

OdometerVerdict Odometer::begin(const OdometerReading& reading) noexcept {
  seen_s_ = reading.time_s;
  is_speed_known_ = !std::isnan(options_.start_speed_m_s);
  start_rate_ = is_speed_known_ ? options_.start_speed_m_s * options_.counts_per_m : 0.0;
  add(reading, 0, 0.0);
  step(0).changed_s = start_rate_ == 0.0 ? kNever_s : reading.time_s;
  return OdometerVerdict::kTaken;
}

OdometerVerdict Odometer::reject(const OdometerReading& reading) noexcept {
  see_gap(reading.time_s);
  ++statistics_.implausible;
  if (++rejected_in_a_row_ < kRejectedUntilRestart) return OdometerVerdict::kImplausible;
  ++statistics_.restarts;
  // Anything that its speed allows may have been driven meanwhile, either way.
  const double most =
      options_.max_speed_m_s * options_.counts_per_m * (reading.time_s - step(0).time_s);
  step(0).is_knot = true;
  add(reading, 0, most * most / 3.0);
  step(0).is_knot = true;
  step(0).changed_s = kNever_s;
  is_speed_known_ = false;
  start_rate_ = 0.0;
  return OdometerVerdict::kRestarted;
}

OdometerVerdict Odometer::take(const OdometerReading& reading, std::int64_t delta) noexcept {
  const bool is_ambiguous =
      is_speed_known_ && sudden_counts(reading.time_s - step(0).time_s) >= half_turn_;
  const bool has_gap = see_gap(reading.time_s);
  const double turn = 2.0 * half_turn_;
  add(reading, delta, is_ambiguous ? turn * turn / 12.0 : 0.0);
  is_speed_known_ = true;
  if (is_ambiguous) {
    ++statistics_.ambiguous;
    return OdometerVerdict::kAmbiguous;
  }
  return has_gap ? OdometerVerdict::kMissed : OdometerVerdict::kTaken;
}

void Odometer::add(const OdometerReading& reading, std::int64_t delta,
                   double lost_variance) noexcept {
  Step next;
  next.time_s = next.changed_s = reading.time_s;
  next.is_knot = true;
  if (size_ > 0) {
    const Step& last = step(0);
    next.counts = last.counts + delta;
    next.lost_variance = last.lost_variance + lost_variance;
    if (delta == 0) next.changed_s = last.changed_s;
    next.is_knot = delta != 0 || next.time_s - next.changed_s >= options_.stall_s;
  }
  turn(size_ > 0 ? step(0) : next, reading, next);
  has_yaw_ = has_yaw_ || !std::isnan(reading.yaw_rate_rad_s);
  newest_ = (newest_ + 1) % steps_.size();
  size_ = std::min(size_ + 1, steps_.size());
  step(0) = next;
  shown_ = reading.counts;
  rejected_in_a_row_ = 0;
  ++statistics_.taken;
}

void Odometer::turn(const Step& from, const OdometerReading& reading, Step& to) const noexcept {
  const double elapsed_s = to.time_s - from.time_s;
  const bool has_rate = !std::isnan(reading.yaw_rate_rad_s);
  to.yaw_rate_rad_s = has_rate ? reading.yaw_rate_rad_s : from.yaw_rate_rad_s;
  const double before_rad_s = has_yaw_ ? from.yaw_rate_rad_s : to.yaw_rate_rad_s;
  to.yaw_rad = from.yaw_rad + 0.5 * (before_rad_s + to.yaw_rate_rad_s) * elapsed_s;
  const double sigma_rad = options_.yaw_rate_sigma_rad_s * elapsed_s;
  to.yaw_variance = from.yaw_variance + sigma_rad * sigma_rad;
}

bool Odometer::see_gap(double time_s) noexcept {
  const double elapsed_s = time_s - seen_s_;
  seen_s_ = time_s;
  const bool is_gap = period_s_ > 0.0 && elapsed_s > kGapFromPeriods * period_s_;
  if (is_gap) {
    statistics_.missed += static_cast<std::uint64_t>(std::llround(elapsed_s / period_s_)) - 1;
    return true;
  }
  // Follows slowly; a first interval that was itself a gap is forgotten at once.
  constexpr double kFollow = 0.1;
  const bool is_new = period_s_ == 0.0 || kGapFromPeriods * elapsed_s < period_s_;
  period_s_ = is_new ? elapsed_s : period_s_ + kFollow * (elapsed_s - period_s_);
  return false;
}

bool Odometer::is_standing() const noexcept {
  return step(0).time_s - step(0).changed_s >= options_.stall_s;
}

// The knot from which on the speed at another is taken; `size_` where there is none.
std::size_t Odometer::window_from(std::size_t newer) const noexcept {
  std::size_t older = knot_from(newer + 1);
  while (older < size_) {
    const bool is_enough = std::abs(step(newer).counts - step(older).counts) >= kCountsOfSpeed;
    const std::size_t next = knot_from(older + 1);
    if (is_enough || next >= size_ || next > newer + kReadingsOfSpeed) return older;
    older = next;
  }
  return older;
}

// Counts a second. Where none came for a while it is less than one in that while.
double Odometer::rate_now() const noexcept {
  if (is_standing()) return 0.0;
  const std::size_t newer = knot_from(0);
  const std::size_t older = window_from(newer);
  if (older >= size_) return start_rate_;
  const Step& from = step(older);
  const Step& to = step(newer);
  const double rate = static_cast<double>(to.counts - from.counts) / (to.time_s - from.time_s);
  const double quiet_s = step(0).time_s - to.time_s;
  return quiet_s > 0.0 ? std::clamp(rate, -1.0 / quiet_s, 1.0 / quiet_s) : rate;
}

int Odometer::direction() const noexcept {
  const double rate = size_ == 0 ? 0.0 : rate_now() * options_.counts_per_m;
  return (rate > 0.0 ? 1 : 0) - (rate < 0.0 ? 1 : 0);
}

Motion Odometer::at(double time_s) const noexcept {
  Motion none;
  none.time_s = time_s;
  if (size_ == 0 || !(time_s >= step(size_ - 1).time_s)) return none;
  if (time_s > step(0).time_s + options_.stall_s) return none;
  std::size_t before = 0;  // The last reading not after it.
  for (std::size_t end = size_; before + 1 < end;) {
    const std::size_t middle = before + (end - before) / 2;
    // Steps are the older the further back: looks for the first that is not after `time_s`.
    if (step(middle - 1).time_s <= time_s) {
      end = middle;
    } else {
      before = middle;
    }
  }
  return describe(before, time_s, place_at(before, time_s));
}

Odometer::Place Odometer::place_at(std::size_t before, double time_s) const noexcept {
  const std::size_t older = knot_from(before);
  std::size_t newer = before;
  while (newer > 0 && !step(newer - 1).is_knot) --newer;
  if (newer == 0) return beyond(time_s);
  if (older >= size_) return {Motion::kUnknown, Motion::kUnknown, 0.0};  // Beyond the history.
  const Step& from = step(older);
  const Step& to = step(newer - 1);
  const double window_s = to.time_s - from.time_s;
  const double rate = static_cast<double>(to.counts - from.counts) / window_s;
  return {static_cast<double>(from.counts) + rate * (time_s - from.time_s), rate, window_s};
}

// After the last knot: on with its speed, but up to the last reading less than a count, since none
// was seen.
Odometer::Place Odometer::beyond(double time_s) const noexcept {
  const std::size_t newest_knot = std::min(knot_from(0), size_ - 1);
  const std::size_t older = window_from(newest_knot);
  const Step& knot = step(newest_knot);
  const double rate = rate_now();
  const double quiet_s = std::min(time_s, step(0).time_s) - knot.time_s;
  const double seen = std::clamp(rate * quiet_s, -1.0, 1.0);
  const double on = rate * std::max(0.0, time_s - step(0).time_s);
  double window_s = older < size_ ? knot.time_s - step(older).time_s : options_.stall_s;
  // How long it has not moved by a count, as far as that is remembered.
  const double remembered_s = step(0).time_s - step(size_ - 1).time_s;
  window_s = std::max(window_s, std::min(step(0).time_s - step(0).changed_s, remembered_s));
  return {static_cast<double>(knot.counts) + seen + on, rate, window_s};
}

Motion Odometer::describe(std::size_t before, double time_s, const Place& place) const noexcept {
  const Step& base = step(before);
  const double per_m = options_.counts_per_m;
  const double since_s = time_s - base.time_s;
  Motion motion;
  motion.time_s = time_s;
  motion.distance_m = place.counts / per_m;
  motion.speed_m_s = place.rate / per_m;
  const double later = std::max(0.0, time_s - step(0).time_s);
  const double rate_variance = kVarianceOfDifference / (place.window_s * place.window_s);
  const double counts_variance =
      kVarianceOfDifference + base.lost_variance + rate_variance * later * later;
  motion.sigma_distance_m =
      std::hypot(std::sqrt(counts_variance) / per_m, options_.scale_sigma * motion.distance_m);
  motion.sigma_speed_m_s =
      std::hypot(std::sqrt(rate_variance) / per_m, options_.scale_sigma * motion.speed_m_s);
  if (!has_yaw_) return motion;
  const double share = before == 0 ? 0.0 : since_s / (step(before - 1).time_s - base.time_s);
  const double next_rad_s = before == 0 ? base.yaw_rate_rad_s : step(before - 1).yaw_rate_rad_s;
  motion.yaw_rate_rad_s = base.yaw_rate_rad_s + share * (next_rad_s - base.yaw_rate_rad_s);
  motion.yaw_rad = base.yaw_rad + 0.5 * (base.yaw_rate_rad_s + motion.yaw_rate_rad_s) * since_s;
  motion.sigma_yaw_rate_rad_s = options_.yaw_rate_sigma_rad_s;
  motion.sigma_yaw_rad =
      std::sqrt(base.yaw_variance + std::pow(options_.yaw_rate_sigma_rad_s * since_s, 2.0));
  return motion;
}

}  // namespace striper
