// SPDX-License-Identifier: Apache-2.0
#include "capture/frame_shapes.hpp"

#include <fmt/format.h>

namespace striper::detail {

std::string shape_words(cv::Size size, int type) {
  return fmt::format("{}x{} {} of {} bits", size.width, size.height,
                     CV_MAT_CN(type) == 1 ? "grey" : "colour",
                     CV_MAT_DEPTH(type) == CV_16U ? 16 : 8);
}

std::string FrameShapes::difference(const Frame& frame) {
  const Shape shape{frame.image.size(), frame.image.type()};
  const Shape& first = first_.try_emplace(frame.field, shape).first->second;
  if (shape.size == first.size && shape.type == first.type) return {};
  return fmt::format("is {}, but the first one is {}", shape_words(shape.size, shape.type),
                     shape_words(first.size, first.type));
}

}  // namespace striper::detail
