// SPDX-License-Identifier: Apache-2.0
#include "scans.hpp"

#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <sys/mman.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/core/return_status.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/stream/sinks/csv_sink.hpp>

#include "bindings.hpp"
#include "numpy_arrays.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

std::string word_of(Field field) {
  if (field == Field::kTop) return "top";
  return field == Field::kBottom ? "bottom" : "progressive";
}

py::array_t<double> points_of(const PolarScan& scan) {
  py::ssize_t count = 0;
  for (const Return& r : scan.returns)
    count += static_cast<py::ssize_t>(r.status == ReturnStatus::kOk);
  py::array_t<double> points({count, py::ssize_t{3}});
  auto to = points.mutable_unchecked<2>();
  py::ssize_t row = 0;
  for (const Return& r : scan.returns) {
    if (r.status != ReturnStatus::kOk) continue;
    to(row, 0) = r.x_m;
    to(row, 1) = r.y_m;
    to(row, 2) = 0.0;
    ++row;
  }
  return points;
}

void write_csv(const PolarScan& scan, const std::string& path, const CsvOptions& options) {
  CsvSink sink(path, options);
  sink.write(scan);
  sink.close();
}

// A file in memory, since tables are written to files.
std::string csv_text(const PolarScan& scan, const CsvOptions& options) {
  const int file = memfd_create("striper-scan.csv", MFD_CLOEXEC);
  if (file < 0) throw Error(ErrorKind::kIo, "no memory for a table", errno);
  const std::string path = fmt::format("/proc/self/fd/{}", file);
  std::string text;
  try {
    write_csv(scan, path, options);
    text = read_text_file(path, "a table");
  } catch (...) {
    close(file);
    throw;
  }
  close(file);
  return text;
}

py::object to_csv(const PolarScan& scan, const py::object& path, bool doubtful, bool missing) {
  const CsvOptions options{.doubtful = doubtful || missing, .missing = missing};
  if (path.is_none()) return py::str(csv_text(scan, options));
  const auto file = path.cast<std::filesystem::path>().string();
  const py::gil_scoped_release unlocked;
  write_csv(scan, file, options);
  return py::none();
}

std::string text_of(const PolarScan& scan) {
  std::size_t ok = 0;
  for (const Return& r : scan.returns)
    ok += static_cast<std::size_t>(r.status == ReturnStatus::kOk);
  return fmt::format("<striper.Scan {}, laser {}: {} ok of {}>", scan.sequence, scan.laser, ok,
                     scan.returns.size());
}

void bind_scan(py::module_& module) {
  py::class_<PolarScan, SharedScan>(
      module, "Scan", "What one lit exposure gives: a return for every column (or row).")
      .def_property_readonly(
          "returns",
          [](const py::object& self) {
            return returns_array(self.cast<const PolarScan&>().returns, self);
          },
          "A structured array, a row for every column: the names and units of the CSV, NaN for "
          "what "
          "does not exist, `status` a number of striper.Status. Read-only, no copy.")
      .def_readonly("frame", &PolarScan::sequence, "The source's number of the frame.")
      .def_property_readonly(
          "time", [](const PolarScan& s) { return s.time.seconds(); },
          "Middle of the exposure, seconds since 1970, or since the first frame without a clock.")
      .def_readonly("laser", &PolarScan::laser)
      .def_property_readonly("head", [](const PolarScan& s) { return std::string(s.head()); })
      .def_property_readonly(
          "frame_id",
          [](const PolarScan& s) { return s.frame ? s.frame->frame_id : std::string(); },
          "Name of the frame that points and ranges are in.")
      .def_property_readonly(
          "T_head_scan",
          [](const PolarScan& s) -> Eigen::Matrix4d {
            return s.frame ? s.frame->T_head_scan.matrix() : Eigen::Matrix4d::Identity();
          },
          "4x4: p_head = T p_scan, metres.")
      .def_property_readonly("axis",
                             [](const PolarScan& s) { return std::string(to_string(s.axis)); })
      .def_property_readonly("field", [](const PolarScan& s) { return word_of(s.field); })
      .def_readonly("is_stripe_seen", &PolarScan::is_stripe_seen,
                    "False: no laser's stripe is in the image.")
      .def("points", points_of, "(N, 3) float64, metres, scan frame: x forward, y left; ok only.")
      .def("to_csv", to_csv, py::arg("path") = py::none(), py::kw_only(),
           py::arg("doubtful") = true, py::arg("missing") = true,
           "The scan as CSV with a header: as text, or into a file. `missing`: every column.")
      .def("__len__", [](const PolarScan& s) { return s.returns.size(); })
      .def("__repr__", text_of);
}

}  // namespace

void bind_scans(py::module_& module) {
  bind_scan(module);
  py::dict words;
  for (int code = 0; code < kReturnStatusCount; ++code) {
    words[py::str(std::string(to_string(static_cast<ReturnStatus>(code))))] = code;
  }
  module.attr("_status_words") = words;
  module.attr("returns_dtype") = returns_dtype();
}

}  // namespace striper::python
