// SPDX-License-Identifier: Apache-2.0
#include "stripe/candidates/searched_part.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/core.hpp>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// Pixels beyond where the stripe can be, for its background; and of a scan line that it can nearly
// always be in, all is searched.
constexpr int kBackgroundAbout = 40;
constexpr double kNearlyAll = 0.9;

cv::Mat part_across(const cv::Mat& image, StripeAxis axis, int begin, int end) {
  if (image.empty()) return {};
  return axis == StripeAxis::kColumns ? image.rowRange(begin, end) : image.colRange(begin, end);
}

LitFrame part_across(const LitFrame& frame, StripeAxis axis, int begin, int end) {
  LitFrame part = frame;
  part.lit = part_across(frame.lit, axis, begin, end);
  part.dark = part_across(frame.dark, axis, begin, end);
  part.variance = part_across(frame.variance, axis, begin, end);
  part.masked = part_across(frame.masked, axis, begin, end);
  AxisGrid& across = axis == StripeAxis::kColumns ? part.grid.v : part.grid.u;
  across.offset = across.sensor(begin);
  return part;
}

}  // namespace

LitFrame SearchedPart::cut(const LitFrame& frame, StripeAxis axis, const ExpectedStripe* expected) {
  const View view{expected, axis, frame.grid, line_count(frame.lit, axis),
                  line_length(frame.lit, axis)};
  if (!(view == view_)) look_at(view);
  const bool is_all = from_px_ == 0 && to_px_ == view.length;
  LitFrame part = is_all ? frame : part_across(frame, axis, from_px_, to_px_);
  ignored_ = IgnoredPixels(expected, part.grid);
  return part;
}

// The same from frame to frame, unless lasers or fields take turns.
void SearchedPart::look_at(const View& view) {
  view_ = view;
  from_px_ = 0;
  to_px_ = view.length;
  const bool is_limited = view.expected != nullptr && !view.expected->first_px.empty();
  first_.resize(is_limited ? static_cast<std::size_t>(view.lines) : 0);
  last_.resize(first_.size());
  if (!is_limited) return;
  const Extent extent = set_limits();
  const bool is_anywhere = extent.first <= static_cast<float>(view.length) && extent.last >= 0.0F &&
                           extent.first <= extent.last;
  if (!is_anywhere) return;
  const int begin = std::clamp(static_cast<int>(extent.first) - kBackgroundAbout, 0, view.length);
  const int end = std::clamp(static_cast<int>(extent.last) + kBackgroundAbout, begin, view.length);
  if (end - begin < kLeastLength || end - begin > kNearlyAll * view.length) return;
  from_px_ = begin;
  to_px_ = end;
  for (float& limit : first_) limit -= static_cast<float>(begin);
  for (float& limit : last_) limit -= static_cast<float>(begin);
}

SearchedPart::Extent SearchedPart::set_limits() {
  const ExpectedStripe& expected = *view_.expected;
  const AxisGrid& along = view_.axis == StripeAxis::kColumns ? view_.grid.u : view_.grid.v;
  const AxisGrid& across = grid_across(view_.grid, view_.axis);
  const auto sensor_lines = static_cast<std::ptrdiff_t>(expected.first_px.size());
  Extent extent{std::numeric_limits<float>::max(), -1.0F};
  for (std::size_t i = 0; i < first_.size(); ++i) {
    const std::ptrdiff_t line = std::lround(along.sensor(static_cast<double>(i)));
    const auto at = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(line, 0, std::max<std::ptrdiff_t>(0, sensor_lines - 1)));
    first_[i] = static_cast<float>(across.index(expected.first_px[at]));
    last_[i] = static_cast<float>(across.index(expected.last_px[at]));
    extent.first = std::min(extent.first, first_[i]);
    extent.last = std::max(extent.last, last_[i]);
  }
  return extent;
}

void SearchedPart::refuse_outside(PeakList& peaks) const {
  if (first_.empty() && !ignored_.is_any()) return;
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    const std::int32_t line = peaks.seeds[i].line;
    const auto across = static_cast<float>(peaks.across[i]);
    const bool is_outside = is_limited() && (across < first_of(line) || across > last_of(line));
    if (is_outside || ignored_.has(view_.axis, line, peaks.across[i])) peaks.blank(i);
  }
}

}  // namespace striper::detail
