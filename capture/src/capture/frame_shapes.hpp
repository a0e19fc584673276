// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include <opencv2/core/mat.hpp>

#include <striper/core/frame.hpp>

namespace striper::detail {

/// `640x480 grey of 8 bits`.
std::string shape_words(cv::Size size, int type);

/// Holds the frames of a file to one size and pixel type, each kind of field to its own.
class FrameShapes {
 public:
  void reset() { first_.clear(); }

  /// How a frame's image differs from the first one's, to be put after its name; empty where it
  /// does not. Allocates nothing then.
  std::string difference(const Frame& frame);

 private:
  struct Shape {
    cv::Size size;
    int type = 0;
  };
  std::map<Field, Shape> first_;
};

}  // namespace striper::detail
