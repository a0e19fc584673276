// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

namespace striper::speed {

// What one would write with OpenCV to find a stripe: the brightest pixel of every column, in three
// ways, and the ridge. One thread, fresh buffers, as one would write it.

void reduce_argmax(const cv::Mat& image);

void transpose_and_search(const cv::Mat& image);

void blur_and_search(const cv::Mat& image);

/// Steger 1998 written plainly: derivatives of the smoothed image, the ridge where the step along
/// the Hessian's strongest direction stays inside the pixel. Returns the number of ridge points.
int steger(const cv::Mat& image);

}  // namespace striper::speed
