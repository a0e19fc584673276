// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

namespace striper::detail {

/// Whether a frame looks interlaced: in blocks here and there, where something moved or
/// the laser lights one field only, a row is less like the next one than like the next but one. A
/// mosaic of colour filters, which does the same along the rows, does not count.
///
/// @param image 8 or 16 bits, 1 or 3 channels. Cost: two readings of the image.
bool looks_interlaced(const cv::Mat& image);

}  // namespace striper::detail
