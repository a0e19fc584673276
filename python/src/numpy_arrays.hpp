// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>
#include <pybind11/numpy.h>

#include <striper/scan/polar_scan.hpp>

namespace striper::python {

/// The returns as a structured array: the CSV's names, units and order; `status` is a number of
/// striper.Status. Shares their memory, read-only; `owner` lives as long as the array.
pybind11::array returns_array(const std::vector<Return>& returns, pybind11::handle owner);

/// The type of its elements.
pybind11::dtype returns_dtype();

/// An image's pixels, (rows, columns) or (rows, columns, 3) in the order B, G, R; shared and
/// read-only as above.
pybind11::array image_array(const cv::Mat& image, pybind11::handle owner);

/// An image from an array of 8 or 16 bits, copied. @throws Error{kBadValue} for anything else.
cv::Mat image_of(const pybind11::array& pixels);

}  // namespace striper::python
