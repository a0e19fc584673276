// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/model/striper_model.hpp>

namespace striper {

/// Where no stripe is looked for: a bumper, a window, the neighbour's laser. What lies in any of
/// its polygons, or is black in its image, is ignored as if no light came from there; the rest of
/// its column (or row) is searched as ever.
struct ScanMask {
  using Polygon = std::vector<cv::Point2d>;

  std::string name;             ///< Its file, for messages.
  std::vector<Polygon> pixels;  ///< Of the full sensor.
  std::vector<Polygon> metres;  ///< Of the scan plane, x forward and y left: needs a model.
  cv::Mat image;                ///< CV_8UC1 of the full sensor: 0 is ignored. May be empty.
};

/// Reads a mask: an image file, or a YAML file
///
///     striper_mask: 1
///     pixels: [[[0, 400], [639, 400], [639, 479], [0, 479]]]
///     metres: [[[0.2, -0.4], [0.6, -0.4], [0.6, 0.4], [0.2, 0.4]]]
///
/// of polygons with three corners or more, each where there are any.
/// @throws Error{kNotFound, kIo} where it cannot be read, Error{kBadFile} naming file, line, field
///         and what was expected.
ScanMask load_mask(const std::filesystem::path& path);

/// Which pixels of the full sensor a mask has a laser's stripe ignored in: CV_8UC1, 255 there and 0
/// elsewhere, of the sensor's size; without a model of the size that the mask itself has. Once per
/// mask: 40 ns a pixel where there are polygons in metres.
/// @param model may be null.
/// @throws Error{kBadValue} where metres meet no model, or an image is of another size.
cv::Mat ignored_pixels(const ScanMask& mask, const StriperModel* model, int laser);

}  // namespace striper
