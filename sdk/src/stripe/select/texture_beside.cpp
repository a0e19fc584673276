// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/texture_beside.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/core/mat.hpp>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

constexpr float kProfile = 3.0F;  // Widths.
constexpr float kSpacing = 0.75F;
constexpr int kPlaces = 9;
constexpr float kApart = 2.0F;
// A width that is measured of texture may be anything.
constexpr float kNarrowest_px = 0.7F;
constexpr float kWidest_px = 8.0F;

template <typename Pixel>
float texture_in(const LitLine<Pixel>& line, float across, float measured_width) {
  const float width = std::clamp(measured_width, kNarrowest_px, kWidest_px);
  const int apart = std::max(2, static_cast<int>(std::lround(kApart * width)));
  const int middle = static_cast<int>(std::lround(across));
  const auto value = [&](int k) { return static_cast<float>(line.value(k)); };
  float squares = 0.0F;
  int count = 0;
  for (const int side : {-1, 1}) {
    int last = 0;
    for (int place = 0; place < kPlaces; ++place) {
      const float off_px = (kProfile + kSpacing * static_cast<float>(place)) * width;
      const int off = static_cast<int>(std::lround(off_px)) + apart;
      const int k = middle + side * off;
      if (off == last || k < apart || k + apart >= line.length()) continue;
      last = off;
      const float above = value(k) - 0.5F * (value(k - apart) + value(k + apart));
      squares += above * above;
      ++count;
    }
  }
  return count > 0 ? std::sqrt(squares / static_cast<float>(count)) : 0.0F;
}

}  // namespace

float texture_beside(const LitFrame& frame, StripeAxis axis, int line, float across, float width) {
  return frame.lit.depth() == CV_8U
             ? texture_in(LitLine<std::uint8_t>(frame, axis, line), across, width)
             : texture_in(LitLine<std::uint16_t>(frame, axis, line), across, width);
}

}  // namespace striper::detail
