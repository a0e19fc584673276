// SPDX-License-Identifier: Apache-2.0
#include "stripe/noise/frame_noise.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <striper/core/noise_model.hpp>
#include <striper/core/robust.hpp>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

constexpr int kSamples = 4096;

template <typename Pixel>
void sample_differences(const LitFrame& frame, StripeAxis axis, std::vector<std::int32_t>& out) {
  const int lines = line_count(frame.lit, axis);
  const int length = line_length(frame.lit, axis);
  const auto pairs = static_cast<std::int64_t>(lines) * (length - 1);
  // An odd stride walks over all columns and rows without keeping to a pattern of either.
  const std::int64_t stride = std::max<std::int64_t>(1, pairs / kSamples) | 1;
  for (std::int64_t i = 0; i < pairs; i += stride) {
    const LitLine<Pixel> line(frame, axis, static_cast<int>(i % lines));
    const int k = static_cast<int>(i / lines);
    if (line.clipped(k) || line.clipped(k + 1) || line.masked(k) || line.masked(k + 1)) continue;
    out.push_back(std::abs(line.value(k + 1) - line.value(k)));
  }
}

}  // namespace

double estimate_frame_noise(const LitFrame& frame, StripeAxis axis,
                            std::vector<std::int32_t>& scratch) {
  scratch.clear();
  scratch.reserve(2 * kSamples);
  if (frame.lit.depth() == CV_8U) {
    sample_differences<std::uint8_t>(frame, axis, scratch);
  } else {
    sample_differences<std::uint16_t>(frame, axis, scratch);
  }
  const double floor_dn = std::sqrt(kRounding_dn2);
  if (scratch.empty()) return floor_dn;
  const std::int32_t middle = upper_median(scratch);
  // The median of whole numbers jumps by one; where in its step it lies makes it continuous.
  const auto below =
      std::count_if(scratch.begin(), scratch.end(), [&](int d) { return d < middle; });
  const auto equal = std::count(scratch.begin(), scratch.end(), middle);
  const double within = (0.5 * static_cast<double>(scratch.size()) - static_cast<double>(below)) /
                        static_cast<double>(equal);
  // |difference| = 0 stands for half a step only: it has no negative twin.
  const double median = middle == 0 ? 0.5 * within : middle - 0.5 + within;
  return std::max(floor_dn, kSigmaOfMedianAbsolute * median / std::sqrt(2.0));
}

}  // namespace striper::detail
