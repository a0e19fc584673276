// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_part.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core/mat.hpp>

namespace striper::detail {
namespace {

// Which pixels along one axis of an image have their centres in [first_px, first_px + length_px).
cv::Range indices_of(const AxisGrid& grid, int first_px, int length_px, int size) {
  constexpr double kRounding = 1e-9;
  const double first = grid.index(first_px) - kRounding;
  const double last = grid.index(first_px + length_px - 1) + kRounding;
  const int begin = std::clamp(static_cast<int>(std::ceil(first)), 0, size);
  const int end = std::clamp(static_cast<int>(std::floor(last)) + 1, begin, size);
  return {begin, end};
}

cv::Range in_pairs(const cv::Range& rows, int size) {
  return {rows.start - rows.start % 2, std::min(size, rows.end + rows.end % 2)};
}

}  // namespace

Frame part_of(const Frame& frame, const cv::Rect& region_px) {
  const cv::Range columns =
      indices_of(frame.grid.u, region_px.x, region_px.width, frame.image.cols);
  cv::Range rows = indices_of(frame.grid.v, region_px.y, region_px.height, frame.image.rows);
  if (frame.is_interlaced()) rows = in_pairs(rows, frame.image.rows);
  Frame part = frame;
  const bool is_empty = columns.empty() || rows.empty();
  part.image = is_empty ? cv::Mat() : frame.image(rows, columns);
  part.grid = frame.grid.then(PixelGrid::region(columns.start, rows.start));
  return part;
}

}  // namespace striper::detail
