// SPDX-License-Identifier: Apache-2.0
#include "ambient/pixels/colour_difference.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "core/image_line.hpp"

namespace striper::detail {
namespace {

// Of the largest value: images that were made smaller or compressed clip a little below it.
constexpr double kClippedPart = 0.97;

// What is clipped over more pixels is a surface; a flank is no further from the core than this.
constexpr int kWidestCore = 24;
constexpr int kFarthestFlank = 12;
// Both flanks rise plainly above what is around, from so far to so far beyond the core, by so much
// of full scale and of that itself: grass is green too. The core shows plainly less than both do.
constexpr double kLeastRise = 0.05;
constexpr double kLeastRiseOfGround = 0.5;
constexpr int kGroundFrom = 16;
constexpr int kGroundTo = 48;
constexpr double kHollow = 0.75;

// A scan line of a colour difference.
template <typename Pixel>
struct Difference {
  StridedLine<const Pixel> lit;
  StridedLine<const Pixel> taken_off;
  int length;

  int operator[](int k) const { return lit[k] - taken_off[k]; }
  bool contains(int k) const { return k >= 0 && k < length; }
};

// A flank: its height, and where it has fallen to half beyond that.
struct Flank {
  int height = 0;
  int end = 0;
};

template <typename Pixel>
Flank flank_of(const Difference<Pixel>& line, int core, int direction) {
  Flank flank{0, core};
  int top = core;
  for (int step = 1; step <= kFarthestFlank; ++step) {
    const int k = core + direction * step;
    if (!line.contains(k)) break;
    if (line[k] <= flank.height) continue;
    flank.height = line[k];
    top = k;
  }
  for (int step = 0; step <= kFarthestFlank; ++step) {
    const int k = top + direction * step;
    if (!line.contains(k)) break;
    flank.end = k;
    if (2 * line[k] < flank.height) break;
  }
  return flank;
}

// The mean difference of what is around a core, which coloured ground has too.
template <typename Pixel>
double ground_of(const Difference<Pixel>& line, int first, int last) {
  double sum = 0.0;
  int pixels = 0;
  for (int step = kGroundFrom; step <= kGroundTo; ++step) {
    for (const int k : {first - step, last + step}) {
      if (!line.contains(k)) continue;
      sum += line[k];
      ++pixels;
    }
  }
  return sum / std::max(1, pixels);
}

// Whether the stripe whose core is clipped from `first` to `last` is hollow between its flanks.
template <typename Pixel>
bool is_hollow(const Difference<Pixel>& line, int first, int last, const Flank& before,
               const Flank& after, int full_scale_dn) {
  const int lower = std::min(before.height, after.height);
  if (lower < kLeastRise * full_scale_dn) return false;
  int core = line[first];
  for (int k = first + 1; k <= last; ++k) core = std::min(core, line[k]);
  if (core >= kHollow * lower) return false;
  const double ground = std::max(0.0, ground_of(line, first, last));
  return lower - ground >= std::max(kLeastRise * full_scale_dn, kLeastRiseOfGround * ground);
}

// Where a stripe is hollow: its core is clipped from `first` to `last`, its flanks end at `from`
// and `to`.
struct HollowLine {
  int from;
  int first;
  int last;
  int to;
};

// What is subtracted becomes no brighter than the straight line from the one end to the other, and
// the same all over the core, which stays as flat as clipping made it.
template <typename Pixel>
void flatten(const StridedLine<Pixel>& pixels, const HollowLine& hollow) {
  const int height = pixels[hollow.from];
  const int rise = pixels[hollow.to] - height;
  const int middle = (hollow.first + hollow.last) / 2;
  for (int k = hollow.from + 1; k < hollow.to; ++k) {
    const bool is_core = k >= hollow.first && k <= hollow.last;
    const int at = is_core ? middle : k;
    const int straight = height + rise * (at - hollow.from) / (hollow.to - hollow.from);
    pixels[k] = std::min(pixels[k], static_cast<Pixel>(straight));
  }
}

// Calls `found` with every hollow stripe among clipped pixels.
template <typename Pixel, typename Found>
void for_each_hollow(const Difference<Pixel>& line, const ColourDifference::Span& clipped,
                     int clipped_dn, int full_scale_dn, const Found& found) {
  int core = 0;
  for (int k = clipped.first; k <= clipped.last + 1; ++k) {
    if (k <= clipped.last && line.lit[k] >= clipped_dn) {
      ++core;
      continue;
    }
    const int first = k - core;
    const bool may_be_line = core > 0 && core <= kWidestCore;
    core = 0;
    if (!may_be_line) continue;
    const Flank before = flank_of(line, first, -1);
    const Flank after = flank_of(line, k - 1, 1);
    if (!is_hollow(line, first, k - 1, before, after, full_scale_dn)) continue;
    found(HollowLine{before.end, first, k - 1, after.end});
  }
}

// In the order in which the pixels lie in memory. Returns whether any is clipped.
template <typename Pixel>
bool find_clipped(const cv::Mat& lit, StripeAxis axis, int clipped_dn,
                  std::vector<ColourDifference::Span>& spans) {
  bool any = false;
  spans.assign(static_cast<std::size_t>(line_count(lit, axis)),
               {std::numeric_limits<int>::max(), -1});
  for (int row = 0; row < lit.rows; ++row) {
    const auto* const pixels = lit.ptr<Pixel>(row);
    if (row_maximum(pixels, lit.cols) < clipped_dn) continue;
    any = true;
    for (int col = 0; col < lit.cols; ++col) {
      if (pixels[col] < clipped_dn) continue;
      const bool columns = axis == StripeAxis::kColumns;
      auto& span = spans[static_cast<std::size_t>(columns ? col : row)];
      const int across = columns ? row : col;
      span.first = std::min(span.first, across);
      span.last = across;
    }
  }
  return any;
}

template <typename Pixel>
bool fill(const LitFrame& frame, StripeAxis axis, int clipped_dn,
          const std::vector<ColourDifference::Span>& spans, cv::Mat& filled) {
  const int length = line_length(frame.lit, axis);
  bool any = false;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (spans[i].last < spans[i].first) continue;
    const int number = static_cast<int>(i);
    const Difference<Pixel> line{image_line<Pixel>(frame.lit, axis, number),
                                 image_line<Pixel>(frame.dark, axis, number), length};
    const auto fill_it = [&](const HollowLine& hollow) {
      if (!any) frame.dark.copyTo(filled);
      any = true;
      flatten(writable_line<Pixel>(filled, axis, number), hollow);
    };
    for_each_hollow(line, spans[i], clipped_dn, frame.full_scale_dn, fill_it);
  }
  return any;
}

template <typename Pixel>
bool mark_masked(const LitFrame& frame, cv::Mat& masked) {
  bool any = false;
  for (int row = 0; row < frame.lit.rows; ++row) {
    auto* const marks = masked.ptr<std::uint8_t>(row);
    const auto* const lit = frame.lit.ptr<Pixel>(row);
    const auto* const dark = frame.dark.ptr<Pixel>(row);
    if (row_maximum(dark, frame.dark.cols) < frame.full_scale_dn) {
      std::memset(marks, 0, static_cast<std::size_t>(masked.cols));
      continue;
    }
    std::uint8_t any_here = 0;
    for (int col = 0; col < frame.lit.cols; ++col) {
      const bool is_masked = lit[col] >= frame.full_scale_dn && dark[col] >= frame.full_scale_dn;
      marks[col] = is_masked ? 1 : 0;
      any_here |= marks[col];
    }
    any = any || any_here != 0;
  }
  return any;
}

template <typename Pixel>
void correct_pixels(LitFrame& frame, StripeAxis axis, std::vector<ColourDifference::Span>& spans,
                    cv::Mat& filled, cv::Mat& masked) {
  const int clipped_dn = static_cast<int>(std::ceil(kClippedPart * frame.full_scale_dn));
  if (!find_clipped<Pixel>(frame.lit, axis, clipped_dn, spans)) return;
  if (fill<Pixel>(frame, axis, clipped_dn, spans, filled)) frame.dark = filled;
  if (mark_masked<Pixel>(frame, masked)) frame.masked = masked;
}

}  // namespace

void ColourDifference::correct(LitFrame& frame, StripeAxis axis) {
  filled_.create(frame.dark.size(), frame.dark.type());
  masked_.create(frame.dark.size(), CV_8UC1);
  if (frame.lit.depth() == CV_8U) {
    correct_pixels<std::uint8_t>(frame, axis, clipped_, filled_, masked_);
  } else {
    correct_pixels<std::uint16_t>(frame, axis, clipped_, filled_, masked_);
  }
}

}  // namespace striper::detail
