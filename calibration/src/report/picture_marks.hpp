// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <striper/session/calibrate.hpp>

namespace striper::detail {

/// An image of the calibration made small, corners and stripe drawn into it, as an <img> that
/// holds its own data. Empty where the image cannot be read any more.
std::string thumbnail(const Calibration& calibration, const ImageResult& result);

/// The surroundings of an outlier, enlarged, as an <img>.
std::string outlier_crop(const Calibration& calibration, const OutlierPoint& outlier);

}  // namespace striper::detail
