// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/profile/average.hpp>

namespace striper {
namespace {

// Sigmas of chi2 beyond which a return moves: error bars are right to some tens of percent, and of
// thousands of returns none that stands still should be refused.
constexpr double kMoves = 8.0;
constexpr int kMostScans = 10000;
constexpr double kSameLine_px = 0.25;  // Half of what fields are apart.

// Returns are matched by their place in the scan.
void require_same_lines(const PolarScan& first, const PolarScan& scan) {
  bool is_same = first.returns.size() == scan.returns.size();
  for (std::size_t i = 0; is_same && i < scan.returns.size(); ++i) {
    const double apart =
        first.returns[i].along_px(first.axis) - scan.returns[i].along_px(scan.axis);
    is_same = !(std::abs(apart) > kSameLine_px);
  }
  if (is_same) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("scans {} and {} have returns of different columns or rows: to average "
                          "tables, write them with --missing",
                          first.sequence, scan.sequence));
}

}  // namespace

ScanAverager::ScanAverager(int scans) : scans_(scans) {
  if (scans >= 1 && scans <= kMostScans) return;
  throw Error(ErrorKind::kBadValue,
              fmt::format("average is {}; expected 1 to {}", scans, kMostScans));
}

void ScanAverager::take(const Return& r, Sums& sums) const {
  if (r.status != ReturnStatus::kOk || !(r.range_m > 0.0)) return;
  const double q = 1.0 / r.range_m;
  if (sums.count++ == 0) sums.first_q = q;
  sums.q += q - sums.first_q;
  sums.qq += (q - sums.first_q) * (q - sums.first_q);
  sums.variance += std::pow(r.sigma_m * q * q, 2.0);
  sums.row_variance += static_cast<double>(r.row_sigma_px) * static_cast<double>(r.row_sigma_px);
  sums.bearing += r.bearing_rad;
  sums.u += r.u_px;
  sums.v += r.v_px;
  sums.near += 1.0 / r.range_near_m;
  sums.far += 1.0 / r.range_far_m;
  sums.cal += r.sigma_cal_m;
  sums.intensity += static_cast<double>(r.intensity_dn);
  sums.width += static_cast<double>(r.width_px);
  sums.confidence += static_cast<double>(r.confidence);
}

void ScanAverager::begin(Group& group, const PolarScan& scan) {
  group.sums.clear();
  group.sequences.clear();
  group.first = scan.time;
  group.since_first_ns = 0.0;
}

const PolarScan* ScanAverager::add(const PolarScan& scan) {
  Group& group = groups_[{std::string(scan.head()), scan.laser, static_cast<int>(scan.field)}];
  if (group.scans == 0)
    begin(group, scan);
  else
    require_same_lines(group.mean, scan);
  group.sums.resize(std::max(group.sums.size(), scan.returns.size()));
  for (std::size_t i = 0; i < scan.returns.size(); ++i) take(scan.returns[i], group.sums[i]);
  if (group.scans == scans_ / 2 || group.scans == 0) group.mean = scan;
  group.sequences.push_back(scan.sequence);
  group.since_first_ns += static_cast<double>(scan.time.monotonic_ns - group.first.monotonic_ns);
  ++group.scans;
  return group.scans == scans_ ? conclude(group) : nullptr;
}

const PolarScan* ScanAverager::finish() {
  for (auto& [ignored, group] : groups_)
    if (group.scans > 0) return conclude(group);
  return nullptr;
}

const PolarScan* ScanAverager::conclude(Group& group) {
  group.mean.sequence = group.sequences[group.sequences.size() / 2];
  group.mean.time = group.first;
  group.mean.time.monotonic_ns += std::llround(group.since_first_ns / group.scans);
  incomplete_ += group.scans < scans_ ? 1 : 0;
  group.mean.returns.resize(group.sums.size());
  for (std::size_t i = 0; i < group.sums.size(); ++i)
    put(group.sums[i], group.scans, group.mean.returns[i]);
  group.scans = 0;
  return &group.mean;
}

void ScanAverager::put(const Sums& sums, int scans, Return& r) {
  const auto n = static_cast<double>(sums.count);
  if (2 * sums.count < scans || sums.count == 0) {  // Seen now and then.
    if (r.status == ReturnStatus::kOk) r.status = ReturnStatus::kOutlier;
    return;
  }
  const double dof = n - 1.0;
  const double chi2 = (sums.qq - sums.q * sums.q / n) / (sums.variance / n);
  if (chi2 > dof + kMoves * std::sqrt(2.0 * dof)) {
    ++moved_;
    if (r.status == ReturnStatus::kOk) r.status = ReturnStatus::kOutlier;
    return;
  }
  ++still_;
  const double q = sums.first_q + sums.q / n;
  r.status = ReturnStatus::kOk;
  r.range_m = 1.0 / q;
  r.bearing_rad = sums.bearing / n;
  r.x_m = r.range_m * std::cos(r.bearing_rad);
  r.y_m = r.range_m * std::sin(r.bearing_rad);
  r.range_near_m = n / sums.near;
  r.range_far_m = n / sums.far;
  r.u_px = sums.u / n;
  r.v_px = sums.v / n;
  r.sigma_m = std::sqrt(sums.variance) / n / (q * q);
  r.sigma_cal_m = sums.cal / n;
  r.row_sigma_px = static_cast<float>(std::sqrt(sums.row_variance) / n);
  r.intensity_dn = static_cast<float>(sums.intensity / n);
  r.width_px = static_cast<float>(sums.width / n);
  r.confidence = static_cast<float>(sums.confidence / n);
}

}  // namespace striper
