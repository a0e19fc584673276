// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <opencv2/core/types.hpp>

namespace striper::detail {

/// What the reader of a live source relies on from the first frame to the last. A device that was
/// lost may come back with other settings, or another one in its place.
struct StreamKind {
  cv::Size image_size;
  cv::Size sensor_size;
  int bit_depth = 0;
  int channels = 0;
  std::string layout;  ///< Of the device's buffers, where the source relies on that too.
  std::string words;   ///< All of it for a message; not compared.

  bool is_same(const StreamKind& other) const {
    return image_size == other.image_size && sensor_size == other.sensor_size &&
           bit_depth == other.bit_depth && channels == other.channels && layout == other.layout;
  }
};

}  // namespace striper::detail
