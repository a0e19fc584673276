// SPDX-License-Identifier: Apache-2.0
#include "profile/inverse_ranges.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

// Below this part of the distance a sigma is taken for this much, so that the sums keep their
// digits; a tenth of what the best laser profilers resolve.
constexpr double kLeastRelativeSigma = 1e-6;

}  // namespace

void InverseRanges::clear() noexcept {
  index.clear();
  cosine.clear();
  sine.clear();
  q.clear();
  weight.clear();
  noise.clear();
}

void InverseRanges::take(const PolarScan& scan, const Eigen::Vector2d& pivot_m) {
  clear();
  pivot = pivot_m;
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    const Return& r = scan.returns[i];
    if (r.status != ReturnStatus::kOk || !(r.sigma_m > 0.0) || !(r.range_m > 0.0)) continue;
    const double x = r.x_m - pivot_m.x();
    const double y = r.y_m - pivot_m.y();
    const double distance = std::hypot(x, y);
    if (!(distance > 0.0) || !std::isfinite(distance)) continue;
    // The noise moves a return along the line through the pivot; sigma_m is what that does to the
    // range from the origin.
    const double along = std::abs(x * r.x_m + y * r.y_m) / (distance * r.range_m);
    const double sigma = std::max(r.sigma_m / along, kLeastRelativeSigma * distance);
    const double sigma_q = sigma / (distance * distance);
    index.push_back(i);
    cosine.push_back(x / distance);
    sine.push_back(y / distance);
    q.push_back(1.0 / distance);
    weight.push_back(1.0 / (sigma_q * sigma_q));
    noise.push_back(sigma_q * sigma_q);
  }
}

void InverseRanges::remove_marked(const std::vector<char>& marked) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    if (marked[i]) continue;
    index[kept] = index[i];
    cosine[kept] = cosine[i];
    sine[kept] = sine[i];
    q[kept] = q[i];
    weight[kept] = weight[i];
    noise[kept] = noise[i];
    ++kept;
  }
  index.resize(kept);
  cosine.resize(kept);
  sine.resize(kept);
  q.resize(kept);
  weight.resize(kept);
  noise.resize(kept);
}

}  // namespace striper::detail
