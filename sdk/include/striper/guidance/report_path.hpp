// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace striper {

struct ReportPathOptions {
  std::vector<double> beam_x_m;  ///< Where the beams cross the road, forward of the gun; 1 to 8.
  /// Share of the last answer in the next one, 0 up to but not 1 (the report's alpha, equation 10).
  double alpha = 0.5;

  /// @throws Error{kBadValue} naming field, value and bound.
  void validate() const;
};

/// The stripe at the gun.
struct ReportPathPoint {
  double lateral_m = std::numeric_limits<double>::quiet_NaN();  ///< NaN until a beam has seen it.
  int beams = 0;  ///< That saw the stripe this time; 0: the last answer is kept.
};

/// Follows a stripe as the report did: the polynomial through the beams that see it, at the gun,
/// and exponential smoothing over the scans. The baseline that a better method is measured against:
/// it has no error bar, lags by alpha / (1 - alpha) scans, and knows no speed.
///
/// Three beams give the parabola, two the straight line, one a parallel to the vehicle; of beams
/// that do not see the stripe just now the last position counts, of those that never have none.
/// Without any beam the last answer stays, as between the dashes of a skip line.
///
/// No allocation after construction. Not thread-safe.
/// Source: section 2.3, equations (1) to (13), of Advanced Retro Technology, *Automated Paint
/// Restriping Recognition and Guidance System*, UCD-ARR-91-11-01-01, 1991. It does not say what it
/// did where a beam sees nothing. With last positions errors on broken lines are .42 and 1.17
/// in where others computed .44 and 1.18 of it; with lines and parallels through the beams that see
/// just now they are .40 and .96.
class ReportPath {
 public:
  explicit ReportPath(const ReportPathOptions& options);  ///< @throws Error as `validate` does.

  /// Takes one scan of all beams.
  /// @param beam_lateral_m where each sees the stripe, in their order; NaN: it does not
  /// @throws nothing; beams that are not in the list are not looked at, missing ones see nothing
  ReportPathPoint update(std::span<const double> beam_lateral_m) noexcept;

 private:
  std::size_t beams_;
  double alpha_;
  std::vector<double> last_m_;  // Of each beam; NaN until it has seen the stripe.
  std::vector<double>
      weights_;  // `beams_` for each set of beams, bit i of its index: beam i has seen.
  double lateral_m_ = std::numeric_limits<double>::quiet_NaN();
};

/// Smooth as the report's computer did: (now + last) >> 1, in counts of the converter (equation
/// 14). Rounds down, so that it settles up to one count low.
constexpr int report_integer_smoothing(int now, int last) noexcept { return (now + last) >> 1; }

}  // namespace striper
