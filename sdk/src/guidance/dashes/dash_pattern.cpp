// SPDX-License-Identifier: Apache-2.0
#include "guidance/dashes/dash_pattern.hpp"

#include <cmath>

namespace striper::detail {
namespace {

// Two worn ends of 2.5 in each, as in the report's Table 1, three sigma; and 3 % of a cycle for an
// odometer that is not calibrated to the road.
constexpr double kEnd_m = 0.2;
constexpr double kCycleShare = 0.03;
constexpr double kLearn = 0.2;
constexpr double kQuality = 0.1;
constexpr int kMostMisfits = 2;

}  // namespace

DashPattern::DashPattern(const GuidanceLine& line) noexcept
    : is_given_(std::isfinite(line.dash_m) && std::isfinite(line.gap_m)),
      dash_m_(line.dash_m),
      cycle_m_(line.dash_m + line.gap_m),
      needed_(is_given_ ? 2 : 3) {}

bool DashPattern::fits(double from_m, double to_m) const noexcept {
  const double length_off_m = std::abs(to_m - from_m - dash_m_);
  if (std::isnan(begin_m_) || std::isnan(cycle_m_)) return !(length_off_m > 2.0 * kEnd_m);
  const double cycles = std::round((from_m - begin_m_) / cycle_m_);
  const double phase_off_m = std::abs(from_m - begin_m_ - cycles * cycle_m_);
  return cycles >= 1.0 && phase_off_m <= kEnd_m + kCycleShare * cycle_m_ * cycles &&
         length_off_m <= 2.0 * kEnd_m;
}

bool DashPattern::expects_begin(double at_m) const noexcept {
  if (!is_locked()) return true;
  const double cycles = std::round((at_m - begin_m_) / cycle_m_);
  return std::abs(at_m - begin_m_ - cycles * cycle_m_) <=
         kEnd_m + kCycleShare * cycle_m_ * std::fmax(cycles, 1.0);
}

void DashPattern::add(double from_m, double to_m) noexcept {
  const bool is_fit = fits(from_m, to_m);
  quality_ += kQuality * ((is_fit ? 1.0 : 0.0) - quality_);
  if (!is_fit) {
    if (++misfits_ < kMostMisfits) return;
    unlock();
  }
  misfits_ = 0;
  const double length_m = to_m - from_m;
  if (std::isnan(dash_m_)) dash_m_ = length_m;
  if (!std::isnan(begin_m_)) {
    const double way_m = from_m - begin_m_;
    if (std::isnan(cycle_m_)) {
      cycle_m_ = way_m;
    } else if (!is_given_ && std::round(way_m / cycle_m_) == 1.0) {
      cycle_m_ += kLearn * (way_m - cycle_m_);
    }
  }
  if (!is_given_) dash_m_ += kLearn * (length_m - dash_m_);
  begin_m_ = from_m;
  ++fits_;
}

void DashPattern::unlock() noexcept {
  fits_ = 0;
  misfits_ = 0;
  begin_m_ = std::numeric_limits<double>::quiet_NaN();
  if (is_given_) return;
  dash_m_ = std::numeric_limits<double>::quiet_NaN();
  cycle_m_ = std::numeric_limits<double>::quiet_NaN();
}

}  // namespace striper::detail
