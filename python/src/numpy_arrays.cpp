// SPDX-License-Identifier: Apache-2.0
#include "numpy_arrays.hpp"

#include <cstddef>
#include <cstring>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace py = pybind11;

namespace striper::python {
namespace {

void make_read_only(py::array& array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
}

py::dtype make_returns_dtype() {
  py::list names;
  py::list formats;
  py::list offsets;
  const auto add = [&](const char* name, const char* format, std::size_t offset) {
    names.append(py::str(name));
    formats.append(py::dtype(format));
    offsets.append(py::int_(offset));
  };
  add("u_px", "f8", offsetof(Return, u_px));
  add("v_px", "f8", offsetof(Return, v_px));
  add("bearing_rad", "f8", offsetof(Return, bearing_rad));
  add("range_m", "f8", offsetof(Return, range_m));
  add("range_near_m", "f8", offsetof(Return, range_near_m));
  add("range_far_m", "f8", offsetof(Return, range_far_m));
  add("sigma_m", "f8", offsetof(Return, sigma_m));
  add("sigma_cal_m", "f8", offsetof(Return, sigma_cal_m));
  add("x_m", "f8", offsetof(Return, x_m));
  add("y_m", "f8", offsetof(Return, y_m));
  add("intensity", "f4", offsetof(Return, intensity_dn));
  add("width_px", "f4", offsetof(Return, width_px));
  add("row_sigma_px", "f4", offsetof(Return, row_sigma_px));
  add("confidence", "f4", offsetof(Return, confidence));
  add("status", "u1", offsetof(Return, status));
  return {names, formats, offsets, static_cast<py::ssize_t>(sizeof(Return))};
}

}  // namespace

py::dtype returns_dtype() {
  static const auto* const dtype = new py::dtype(make_returns_dtype());  // Never let go of.
  return *dtype;
}

py::array returns_array(const std::vector<Return>& returns, py::handle owner) {
  py::array array(returns_dtype(), {static_cast<py::ssize_t>(returns.size())},
                  {static_cast<py::ssize_t>(sizeof(Return))}, returns.data(), owner);
  make_read_only(array);
  return array;
}

py::array image_array(const cv::Mat& image, py::handle owner) {
  const py::dtype dtype(image.depth() == CV_16U ? "u2" : "u1");
  std::vector<py::ssize_t> shape{image.rows, image.cols};
  std::vector<py::ssize_t> steps{static_cast<py::ssize_t>(image.step),
                                 static_cast<py::ssize_t>(image.elemSize())};
  if (image.channels() > 1) {
    shape.push_back(image.channels());
    steps.push_back(static_cast<py::ssize_t>(image.elemSize1()));
  }
  py::array array(dtype, shape, steps, image.data, owner);
  make_read_only(array);
  return array;
}

cv::Mat image_of(const py::array& pixels) {
  const bool is_colour = pixels.ndim() == 3 && pixels.shape(2) == 3;
  const bool is_8_bit = pixels.dtype().kind() == 'u' && pixels.itemsize() == 1;
  const bool is_16_bit = pixels.dtype().kind() == 'u' && pixels.itemsize() == 2;
  if ((pixels.ndim() != 2 && !is_colour) || !(is_8_bit || is_16_bit)) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("an image of {} dimensions of {} - expected uint8 or uint16, (rows, "
                            "columns) or (rows, columns, 3)",
                            pixels.ndim(), py::str(pixels.dtype()).cast<std::string>()));
  }
  const auto whole = py::array::ensure(pixels, py::array::c_style);
  cv::Mat image(static_cast<int>(whole.shape(0)), static_cast<int>(whole.shape(1)),
                CV_MAKETYPE(is_8_bit ? CV_8U : CV_16U, is_colour ? 3 : 1));
  std::memcpy(image.data, whole.data(), static_cast<std::size_t>(whole.nbytes()));
  return image;
}

}  // namespace striper::python
