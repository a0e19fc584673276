// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <opencv2/core/mat.hpp>

namespace striper::speed {

/// What reading an image takes at the least: its 64-bit words added up with the machine's widest
/// vectors. The image is continuous.
std::uint64_t sum_of_words(const cv::Mat& image);

/// The same with the image's bytes, which takes an instruction more per vector (psadbw).
std::uint64_t sum_of_bytes(const cv::Mat& image);

}  // namespace striper::speed
