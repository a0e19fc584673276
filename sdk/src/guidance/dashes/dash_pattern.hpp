// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <striper/guidance/guidance_config.hpp>

namespace striper::detail {

/// Finds the rhythm of a broken line and holds on to it.
///
/// Locked when three dashes in a row fit (the first gives a length, the second the cycle), or two
/// where the operator has said both; lets go after two that do not fit in a row, one cycle with
/// nothing being none that does not fit. Locked, it tells what does not fit: words and crosses are
/// no dashes. It never makes a dash that was not seen.
class DashPattern {
 public:
  explicit DashPattern(const GuidanceLine& line) noexcept;

  /// Takes a dash that was seen whole.
  void add(double from_m, double to_m) noexcept;

  bool is_locked() const noexcept { return fits_ >= needed_; }
  /// Whether a dash may begin there; true where nothing is known.
  bool expects_begin(double at_m) const noexcept;
  double dash_m() const noexcept { return dash_m_; }  ///< NaN while unknown.
  double cycle_m() const noexcept { return cycle_m_; }
  double quality() const noexcept { return quality_; }  ///< Share of late dashes that fit, 0 to 1.

  void unlock() noexcept;  ///< The operator's.

 private:
  bool fits(double from_m, double to_m) const noexcept;

  bool is_given_ = false;
  double dash_m_;
  double cycle_m_;
  double begin_m_ = std::numeric_limits<double>::quiet_NaN();  // Of the last that fits.
  int fits_ = 0;
  int misfits_ = 0;  // In a row.
  int needed_ = 3;
  double quality_ = 0.0;
};

}  // namespace striper::detail
