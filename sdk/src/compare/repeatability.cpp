// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include <striper/compare/scan_comparison.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

// Where a return is across the stripe.
double across_px(const PolarScan& scan, const Return& one) {
  return scan.axis == StripeAxis::kColumns ? one.v_px : one.u_px;
}

bool is_good(const Return& one) {
  return one.status == ReturnStatus::kOk && std::isfinite(one.range_m);
}

struct Sums {
  int changes = 0;
  double change_px = 0.0;
  double change_m = 0.0;
  double pixel_m = 0.0;
};

void add(const PolarScan& before, const PolarScan& after, Sums& sums) {
  for (std::size_t i = 0; i < std::min(before.returns.size(), after.returns.size()); ++i) {
    const Return& a = before.returns[i];
    const Return& b = after.returns[i];
    const double pixel_m = a.range_far_m - a.range_near_m;  // Half a pixel to either side.
    if (!is_good(a) || !is_good(b) || !std::isfinite(pixel_m)) continue;
    ++sums.changes;
    sums.change_px += std::abs(across_px(before, a) - across_px(after, b));
    sums.change_m += std::abs(a.range_m - b.range_m);
    sums.pixel_m += pixel_m;
  }
}

}  // namespace

ScanRepeatability repeatability(std::span<const PolarScan> scans) {
  std::map<std::tuple<int, Field>, const PolarScan*> last;
  Sums sums;
  for (const PolarScan& scan : scans) {
    const PolarScan*& before = last[{scan.laser, scan.field}];
    if (before != nullptr) add(*before, scan, sums);
    before = &scan;
  }
  if (sums.changes == 0)
    throw Error(ErrorKind::kBadValue,
                "no column has a range in two scans that follow each other: nothing to compare");
  ScanRepeatability result;
  result.changes = sums.changes;
  result.mean_change_px = sums.change_px / sums.changes;
  result.mean_change_m = sums.change_m / sums.changes;
  result.mean_pixel_m = sums.pixel_m / sums.changes;
  result.ratio = result.mean_change_m / result.mean_pixel_m;
  return result;
}

}  // namespace striper
