// SPDX-License-Identifier: Apache-2.0
// Straight and circular pieces, smoothing, measurements.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <striper/profile/segments.hpp>
#include <striper/profile/smooth.hpp>
#include <striper/profile/tools.hpp>

#include "bindings.hpp"
#include "models.hpp"
#include "scans.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

// Of a scan's own model where none is given: the noise moves its returns along that one's pixels.
SegmentOptions options_of(const PolarScan& scan, const py::object& model, double false_split_rate,
                          bool estimate_texture, bool circles) {
  SegmentOptions options;
  options.false_split_rate = false_split_rate;
  options.estimate_texture = estimate_texture;
  options.find_circles = circles;
  const std::shared_ptr<const StriperModel> given = model_of(model);
  const StriperModel* own = scan.frame ? scan.frame->model.get() : nullptr;
  return options_for(given ? given.get() : own, scan.laser, options);
}

Segmentation segments_of(const PolarScan& scan, const py::object& model, double false_split_rate,
                         bool estimate_texture, bool circles) {
  const SegmentOptions options =
      options_of(scan, model, false_split_rate, estimate_texture, circles);
  const py::gil_scoped_release unlocked;
  Segmentation segmentation;
  Segmenter(options).segment(scan, segmentation);
  return segmentation;
}

SharedScan smoothed(const PolarScan& scan, const py::object& model, double false_split_rate,
                    bool estimate_texture, bool circles) {
  const SegmentOptions options =
      options_of(scan, model, false_split_rate, estimate_texture, circles);
  const py::gil_scoped_release unlocked;
  auto copy = std::make_shared<PolarScan>(scan);
  Smoother(options).smooth(*copy);
  return copy;
}

std::vector<MeasureTool> tools_of(const std::vector<std::string>& texts) {
  std::vector<MeasureTool> tools;
  tools.reserve(texts.size());
  for (const std::string& text : texts) tools.push_back(parse_measure_tool(text));
  return tools;
}

std::vector<Measurement> measure(Measurer& measurer, const PolarScan& scan) {
  const py::gil_scoped_release unlocked;
  return measurer.measure(scan);
}

std::string text_of(const Measurement& m) {
  return fmt::format("<striper.Measurement {}: {:.6g} {} +- {:.2g}, {}>", m.tool, m.value, m.unit,
                     m.sigma, to_string(m.status));
}

void bind_pieces(py::module_& module) {
  py::class_<ScanLine>(module, "ScanLine", "cos(angle) x + sin(angle) y = distance, scan frame.")
      .def_readonly("angle_rad", &ScanLine::angle_rad, "Of the normal, away from the origin.")
      .def_readonly("distance_m", &ScanLine::distance_m)
      .def_readonly("covariance", &ScanLine::covariance,
                    "2x2, of angle and distance: random error.");
  py::class_<ScanCircle>(module, "ScanCircle", "A circle of the scan plane.")
      .def_readonly("centre_m", &ScanCircle::centre_m)
      .def_readonly("radius_m", &ScanCircle::radius_m)
      .def_readonly("is_hollow", &ScanCircle::is_hollow, "Its inside is seen.")
      .def_readonly("covariance", &ScanCircle::covariance, "3x3, of centre and radius.");
  py::class_<Piece>(module, "Piece", "A run of returns on one straight line or circle.")
      .def_readonly("first", &Piece::first, "Of the scan's returns.")
      .def_readonly("last", &Piece::last, "Included.")
      .def_readonly("points", &Piece::points)
      .def_readonly("line", &Piece::line)
      .def_readonly("circle", &Piece::circle, "None of a straight piece.")
      .def_readonly("begin_m", &Piece::begin_m, "(x, y) where the surface begins, scan frame.")
      .def_readonly("end_m", &Piece::end_m)
      .def_readonly("sigma_begin_m", &Piece::sigma_begin_m, "Along the line.")
      .def_readonly("sigma_end_m", &Piece::sigma_end_m)
      .def_readonly("is_rough", &Piece::is_rough)
      .def_readonly("scale", &Piece::scale, "Scatter over noise and texture; 1 unless rough.")
      .def_readonly("chi2", &Piece::chi2)
      .def_readonly("dof", &Piece::dof)
      .def_readonly("evidence", &Piece::evidence,
                    "By how much chi2 grows when it is joined to a neighbour.");
  py::class_<Joint>(module, "Joint", "Between piece i and piece i + 1.")
      .def_property_readonly(
          "kind", [](const Joint& j) { return j.kind == JointKind::kCorner ? "corner" : "step"; })
      .def_readonly("corner_m", &Joint::corner_m, "(x, y) of a corner, scan frame.")
      .def_readonly("covariance", &Joint::covariance, "2x2: random error.")
      .def_readonly("evidence", &Joint::evidence);
  py::class_<Segmentation>(module, "Segmentation", "A scan as pieces, in the order of its returns.")
      .def_readonly("pieces", &Segmentation::pieces)
      .def_readonly("joints", &Segmentation::joints, "One fewer than pieces.")
      .def_readonly("outliers", &Segmentation::outliers, "Indices of returns that are on nothing.")
      .def_readonly("texture_m", &Segmentation::texture_m, "One-sigma roughness of the surfaces.");
}

void bind_measurements(py::module_& module) {
  py::class_<Measurement>(module, "Measurement", "One row of what a tool says of one scan.")
      .def_readonly("tool", &Measurement::tool)
      .def_readonly("value", &Measurement::value, "NaN unless status is ok.")
      .def_readonly("sigma", &Measurement::sigma, "One sigma of the random error.")
      .def_readonly("sigma_cal", &Measurement::sigma_cal,
                    "One sigma of the calibration's, alike in all scans.")
      .def_property_readonly("unit", [](const Measurement& m) { return std::string(m.unit); })
      .def_readonly("points", &Measurement::points)
      .def_property_readonly("status",
                             [](const Measurement& m) { return std::string(to_string(m.status)); })
      .def("__repr__", text_of);
  py::class_<Measurer>(
      module, "Measurer",
      "Measures scans with tools: NAME:TOOL[:REGION[;REGION]], as `striper measure`.")
      .def(py::init([](const std::vector<std::string>& tools, const py::object& model) {
             return std::make_unique<Measurer>(tools_of(tools), model_of(model));
           }),
           py::arg("tools"), py::arg("model") = py::none())
      .def("measure", measure, py::arg("scan"))
      .def_property_readonly("rows", &Measurer::rows, "The names of what every scan gives.");
}

}  // namespace

void bind_profiles(py::module_& module) {
  bind_pieces(module);
  bind_measurements(module);
  const SegmentOptions defaults;
  module.def("segments", segments_of, py::arg("scan"), py::arg("model") = py::none(), py::kw_only(),
             py::arg("false_split_rate") = defaults.false_split_rate,
             py::arg("estimate_texture") = defaults.estimate_texture,
             py::arg("circles") = defaults.find_circles, "Cuts a scan into straight pieces.");
  module.def("smooth", smoothed, py::arg("scan"), py::arg("model") = py::none(), py::kw_only(),
             py::arg("false_split_rate") = defaults.false_split_rate,
             py::arg("estimate_texture") = defaults.estimate_texture,
             py::arg("circles") = defaults.find_circles,
             "A copy in which every return is re-estimated from its piece and neighbours.");
}

}  // namespace striper::python
