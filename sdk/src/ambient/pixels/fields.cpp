// SPDX-License-Identifier: Apache-2.0
#include <striper/ambient/fields.hpp>

namespace striper {
namespace {

// Every other row, from `first_row` on: the same pixels with twice the row pitch. Made from a copy
// of the header, so that the view holds on to the pixels as the frame itself does.
cv::Mat every_other_row(const cv::Mat& image, int first_row) {
  cv::Mat view = image;
  view.data += static_cast<std::size_t>(first_row) * image.step[0];
  view.rows = (image.rows - first_row + 1) / 2;
  view.step[0] *= 2;
  view.flags |= cv::Mat::SUBMATRIX_FLAG;
  view.updateContinuityFlag();
  return view;
}

}  // namespace

std::array<Frame, 2> split_fields(const Frame& frame) {
  std::array<Frame, 2> fields{frame, frame};
  const bool top_first = frame.field == Field::kInterlacedTopFirst;
  for (int i = 0; i < 2; ++i) {
    Frame& field = fields[static_cast<std::size_t>(i)];
    const bool is_top = (i == 0) == top_first;
    field.field = is_top ? Field::kTop : Field::kBottom;
    field.image = every_other_row(frame.image, is_top ? 0 : 1);
    field.grid = frame.grid.then(is_top ? PixelGrid::top_field() : PixelGrid::bottom_field());
    field.exposure_in_picture = i;
    field.exposures_per_picture = 2;
    field.time.monotonic_ns += i * frame.field_period_ns;
  }
  return fields;
}

}  // namespace striper
