// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "ambient/pixels/line_kernels.hpp"

#include <algorithm>
#include <cmath>

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ambient/pixels/line_kernels.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<float>;
using One = hn::CappedTag<float, 1>;

// Calls with the tag of a whole vector and where it starts, all over [first, last): the last one
// reaches back over what was done, and a row shorter than a vector goes one by one.
template <typename Visitor>
HWY_INLINE void for_each_vector(int first, int last, const Visitor& visit) {
  const int n = static_cast<int>(hn::Lanes(Tag()));
  if (last - first < n) {
    for (int i = first; i < last; ++i) visit(One(), i);
    return;
  }
  for (int i = first; i < last; i += n) visit(Tag(), std::min(i, last - n));
}

template <typename D>
HWY_INLINE hn::Vec<D> difference(D d, const float* a, const float* b) {
  return hn::Sub(hn::LoadU(d, a), hn::LoadU(d, b));
}

void heights_at(const BandHeights& b, int i, int before, int after, float* heights) {
  const float sides = std::max(b.over_side[before] - b.under_side[before],
                               b.over_side[after] - b.under_side[after]);
  const float extra = b.variance != nullptr ? b.variance[i] : 0.0F;
  heights[i] = (b.over[i] - b.under[i] - sides) / std::sqrt(b.noise * b.noise + extra);
}

void measure_heights(const BandHeights& b, float* heights, int length) {
  const int first = std::min(b.side, length);
  const int last = std::max(first, length - b.side);
  const auto at_end = [&](int i) {
    heights_at(b, i, std::max(0, i - b.side), std::min(length - 1, i + b.side), heights);
  };
  const float per_noise = 1.0F / b.noise;
  for (int i = 0; i < first; ++i) at_end(i);
  for_each_vector(first, last, [&](auto d, int i) {
    const auto before = difference(d, b.over_side + i - b.side, b.under_side + i - b.side);
    const auto after = difference(d, b.over_side + i + b.side, b.under_side + i + b.side);
    const auto height = hn::Sub(difference(d, b.over + i, b.under + i), hn::Max(before, after));
    if (b.variance == nullptr) {
      hn::StoreU(hn::Mul(height, hn::Set(d, per_noise)), d, heights + i);
      return;
    }
    const auto sigma = hn::Set(d, b.noise);
    const auto variance = hn::MulAdd(sigma, sigma, hn::LoadU(d, b.variance + i));
    hn::StoreU(hn::Div(height, hn::Sqrt(variance)), d, heights + i);
  });
  for (int i = last; i < length; ++i) at_end(i);
}

void take_step(const PathStep& s, const float* heights, int places) {
  for_each_vector(0, places, [&](auto d, int i) {
    auto best = hn::LoadU(d, s.best + i);
    for (int j = 1; j <= s.jump; ++j) {
      const auto from = hn::Max(hn::LoadU(d, s.best + i - j), hn::LoadU(d, s.best + i + j));
      best = hn::Max(best, hn::Sub(from, hn::Set(d, s.toll * static_cast<float>(j))));
    }
    const auto height =
        hn::Min(hn::Max(hn::LoadU(d, heights + i), hn::Set(d, s.lowest)), hn::Set(d, s.highest));
    hn::StoreU(hn::Add(best, height), d, s.next + i);
  });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(measure_heights);
HWY_EXPORT(take_step);

void BandHeights::measure(std::span<float> heights) const {
  HWY_DYNAMIC_DISPATCH(measure_heights)(*this, heights.data(), static_cast<int>(heights.size()));
}
void PathStep::take(std::span<const float> heights) const {
  HWY_DYNAMIC_DISPATCH(take_step)(*this, heights.data(), static_cast<int>(heights.size()));
}

}  // namespace striper::detail
#endif  // HWY_ONCE
