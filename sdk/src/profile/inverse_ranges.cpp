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
  intensity.clear();
  all_intensities_.clear();
  is_part_seen_.clear();
}

void InverseRanges::reserve(std::size_t returns) {
  index.reserve(returns);
  for (std::vector<double>* values : {&cosine, &sine, &q, &weight, &noise})
    values->reserve(returns);
  intensity.reserve(returns);
  all_intensities_.reserve(returns);
  is_part_seen_.reserve(returns);
}

void InverseRanges::take(const PolarScan& scan, const Eigen::Vector2d& pivot_m) {
  clear();
  reserve(scan.returns.size());
  pivot = pivot_m;
  is_part_seen_.assign(scan.returns.size(), 0);
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    const Return& r = scan.returns[i];
    all_intensities_.push_back(std::isfinite(r.intensity_dn) ? static_cast<float>(r.intensity_dn)
                                                             : 0.0F);
    if (r.status != ReturnStatus::kOk || !(r.range_m > 0.0)) continue;
    if (!(r.sigma_m > 0.0) || !std::isfinite(r.sigma_m)) continue;
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
    intensity.push_back(all_intensities_.back());
  }
}

InverseRanges::Beyond InverseRanges::beyond(std::size_t i, bool is_later, float least_dn,
                                            int most) const noexcept {
  const auto step = is_later ? std::ptrdiff_t{1} : std::ptrdiff_t{-1};
  const bool is_last = is_later ? i + 1 == size() : i == 0;
  const std::ptrdiff_t border = is_later ? std::ssize(all_intensities_) : -1;
  const std::ptrdiff_t end =
      is_last ? border : static_cast<std::ptrdiff_t>(index[is_later ? i + 1 : i - 1]);
  Beyond found;
  for (auto k = static_cast<std::ptrdiff_t>(index[i]) + step; k != end; k += step) {
    const auto at = static_cast<std::size_t>(k);
    int& count = is_part_seen_[at] && found.mixed == 0 ? found.part_seen : found.mixed;
    if (!(all_intensities_[at] >= least_dn) || count == most) break;
    ++count;
  }
  return found;
}

void InverseRanges::remove_part_seen(const std::vector<char>& marked) {
  for (std::size_t i = 0; i < size(); ++i)
    if (marked[i]) is_part_seen_[index[i]] = 1;
  remove_marked(marked);
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
    intensity[kept] = intensity[i];
    ++kept;
  }
  index.resize(kept);
  cosine.resize(kept);
  sine.resize(kept);
  q.resize(kept);
  weight.resize(kept);
  noise.resize(kept);
  intensity.resize(kept);
}

}  // namespace striper::detail
