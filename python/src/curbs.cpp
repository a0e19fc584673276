// SPDX-License-Identifier: Apache-2.0
// Curbs, as one scan shows them.
#include <string>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <striper/detect/curb_finder.hpp>

#include "bindings.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

py::dict posterior_of(const CurbFinding& finding) {
  py::dict posterior;
  for (std::size_t kind = 0; kind < kCurbKindCount; ++kind) {
    posterior[py::str(std::string(to_string(static_cast<CurbKind>(kind))))] =
        finding.posterior[kind];
  }
  return posterior;
}

std::vector<CurbFinding> find_curbs(const PolarScan& scan, std::optional<double> up_rad,
                                    double min_height_m, double max_height_m) {
  CurbOptions options;
  options.up_rad = up_rad;
  options.min_height_m = min_height_m;
  options.max_height_m = max_height_m;
  const py::gil_scoped_release unlocked;
  return CurbFinder(options).find(scan).findings;
}

}  // namespace

void bind_curbs(py::module_& module) {
  py::class_<CurbFinding>(module, "CurbFinding",
                          "What one scan shows where the road ends on one side; NaN: not known.")
      .def_property_readonly(
          "kind", [](const CurbFinding& f) { return std::string(to_string(f.kind)); },
          "The most probable: none, up, down, ramp, wall, object or rough.")
      .def_property_readonly("posterior", posterior_of, "Of each kind, by this scan alone.")
      .def_property_readonly("probability", &CurbFinding::probability, "That it is a curb.")
      .def_readonly("foot_m", &CurbFinding::foot_m, "(x, y) where road meets face, scan frame.")
      .def_readonly("top_m", &CurbFinding::top_m, "(x, y) where face meets top.")
      .def_readonly("covariance", &CurbFinding::covariance, "4x4, of foot and edge: random error.")
      .def_readonly("lateral_m", &CurbFinding::lateral_m, "Of the foot along the road's line.")
      .def_readonly("sigma_lateral_m", &CurbFinding::sigma_lateral_m)
      .def_readonly("height_m", &CurbFinding::height_m, "Positive, of kind down too.")
      .def_readonly("sigma_height_m", &CurbFinding::sigma_height_m)
      .def_readonly("sigma_cal_lateral_m", &CurbFinding::sigma_cal_lateral_m,
                    "The calibration's, common to all scans.")
      .def_readonly("sigma_cal_height_m", &CurbFinding::sigma_cal_height_m)
      .def_readonly("face_rad", &CurbFinding::face_rad, "From the road to the face.")
      .def_readonly("sigma_face_rad", &CurbFinding::sigma_face_rad)
      .def_readonly("road", &CurbFinding::road);
  const CurbOptions defaults;
  module.def(
      "find_curbs", find_curbs, py::arg("scan"), py::kw_only(), py::arg("up_rad") = defaults.up_rad,
      py::arg("min_height_m") = defaults.min_height_m,
      py::arg("max_height_m") = defaults.max_height_m,
      "Where the road ends in a scan whose plane cuts the ground: at most one finding a side.");
}

}  // namespace striper::python
