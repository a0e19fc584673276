// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <striper/scan/polar_scan.hpp>

namespace striper {

/// Averages scans of a sensor that stands still (`--average N`).
///
/// Of each return 1/range, bearing and pixel are averaged over the scans in which it is ok, for
/// which these must be half at least; sigma_m and row sigma shrink with the root of their number,
/// sigma_cal_m does not. What moves is refused: a return that scatters by more than its sigmas
/// allow (chi2 beyond dof + 8 sqrt(2 dof), one still one in 1e4 of two scans) is kOutlier, with the
/// values of the middle scan (of the first, where scans end before so many). A mean has the middle
/// one's sequence and the mean of their times. No allocation after the first scans. Not
/// thread-safe.
class ScanAverager {
 public:
  /// @param scans  how many make one, 1 to 10000. @throws Error{kBadValue}.
  explicit ScanAverager(int scans);

  /// Takes a scan; each head, laser and field is averaged for itself.
  /// @throws Error{kUsage} where a scan's returns are of other scan lines than those of the first:
  /// tables of the ok returns alone.
  /// @return the mean where this was the last of its scans, else null; valid until the next call.
  const PolarScan* add(const PolarScan& scan);

  /// The means of what is left over, one after the other; null at the end.
  const PolarScan* finish();

  std::uint64_t incomplete() const noexcept { return incomplete_; }  ///< Means of fewer scans.
  std::uint64_t still() const noexcept { return still_; }  ///< Returns that were averaged.
  std::uint64_t moved() const noexcept { return moved_; }  ///< And those that were refused.

 private:
  struct Sums {
    int count = 0;
    double q = 0.0, qq = 0.0;  // 1/range, less that of the first scan.
    double first_q = 0.0;
    double bearing = 0.0, u = 0.0, v = 0.0, near = 0.0, far = 0.0, cal = 0.0;
    double variance = 0.0;  // Of 1/range.
    double row_variance = 0.0;
    double intensity = 0.0, width = 0.0, confidence = 0.0;
  };
  struct Group {
    int scans = 0;
    std::vector<std::uint64_t> sequences;
    FrameTime first;
    double since_first_ns = 0.0;  // Summed.
    PolarScan mean;               // Of the scan in the middle, until the sums are put into it.
    std::vector<Sums> sums;
  };
  void take(const Return& r, Sums& sums) const;
  const PolarScan* conclude(Group& group);
  static void begin(Group& group, const PolarScan& scan);
  void put(const Sums& sums, int scans, Return& r);

  int scans_;
  std::map<std::tuple<std::string, int, int>, Group> groups_;
  std::uint64_t incomplete_ = 0;
  std::uint64_t still_ = 0;
  std::uint64_t moved_ = 0;
};

}  // namespace striper
