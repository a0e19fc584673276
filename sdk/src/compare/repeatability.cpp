// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <tuple>

#include <striper/compare/scan_comparison.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

bool is_good(const Return& one) {
  return one.status == ReturnStatus::kOk && std::isfinite(one.range_m);
}

struct Sums {
  int changes = 0;
  int without_pixel = 0;
  double change_px = 0.0;
  double change_m = 0.0;
  double pixel_m = 0.0;
};

void add(StripeAxis axis, const Return& a, const Return& b, Sums& sums) {
  const double pixel_m = a.range_far_m - a.range_near_m;  // Half a pixel to either side.
  if (!is_good(a) || !is_good(b)) return;
  const double change_px = std::abs(a.across_px(axis) - b.across_px(axis));
  if (!std::isfinite(pixel_m) || !std::isfinite(change_px)) {
    ++sums.without_pixel;
    return;
  }
  ++sums.changes;
  sums.change_px += change_px;
  sums.change_m += std::abs(a.range_m - b.range_m);
  sums.pixel_m += pixel_m;
}

// Of the same scan line each: scans may have some without a return, or leave them out.
void add(const PolarScan& before, const PolarScan& after, Sums& sums) {
  const StripeAxis axis = before.axis;
  std::map<double, const Return*> lines;
  for (const Return& b : after.returns) {
    if (std::isfinite(b.along_px(axis)))
      lines.emplace(b.along_px(axis), &b);
    else
      sums.without_pixel += is_good(b) ? 1 : 0;
  }
  for (const Return& a : before.returns) {
    const auto b = lines.find(a.along_px(axis));
    if (b != lines.end()) add(axis, a, *b->second, sums);
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
  if (sums.changes == 0 && sums.without_pixel > 0)
    throw Error(ErrorKind::kBadValue,
                "the returns do not say their pixels (u_px, v_px, range_near_m, range_far_m), in "
                "which repeatability is told");
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
