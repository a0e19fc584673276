// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <opencv2/core/mat.hpp>

namespace striper {

/// A decoded image file.
struct DecodedImage {
  cv::Mat image;      ///< CV_8UC1, CV_16UC1, CV_8UC3 or CV_16UC3 (B, G, R as in OpenCV).
  int bit_depth = 8;  ///< 8 or 16 as stored; for PGM and PPM what their maximum needs, 8 to 16.
};

/// Reads an image file: PNG, JPEG, TIFF, BMP, PGM or PPM, told apart by content.
///
/// Grey stays grey, colour becomes B, G, R, an alpha channel is dropped, a palette is applied. The
/// orientation tag of a JPEG is ignored: pixels stay where the sensor had them.
///
/// An image file that does not decode to its end is refused; a truncated JPEG too, which decoders
/// commonly complete with grey.
/// @throws Error{kNotFound} where there is no such file, Error{kIo} where it cannot be read,
///         Error{kBadFile} naming the file and what is wrong in it.
DecodedImage read_image(const std::filesystem::path& path);

}  // namespace striper
