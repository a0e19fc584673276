// SPDX-License-Identifier: Apache-2.0
#include "models.hpp"

#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <striper/core/channel.hpp>
#include <striper/model/model_yaml.hpp>

#include "bindings.hpp"
#include "events.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

Eigen::Matrix3d camera_matrix(const CameraModel& camera) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  matrix(0, 0) = camera.fx();
  matrix(1, 1) = camera.fy();
  matrix(0, 2) = camera.cx();
  matrix(1, 2) = camera.cy();
  return matrix;
}

std::string text_of(const StriperModel& model) {
  return fmt::format("<striper.Model {}x{}, {} laser{}, along {}>", model.camera.width(),
                     model.camera.height(), model.lasers.size(),
                     model.lasers.size() == 1 ? "" : "s", to_string(model.axis));
}

void bind_camera(py::module_& module) {
  py::class_<CameraModel>(module, "Camera", "Points of the camera frame to pixels and back.")
      .def_property_readonly("width", &CameraModel::width, "Of the full sensor, pixels.")
      .def_property_readonly("height", &CameraModel::height)
      .def_property_readonly("matrix", camera_matrix, "3x3: fx, fy, cx, cy; pixels.")
      .def_property_readonly(
          "lens", [](const CameraModel& c) { return std::string(to_string(c.lens())); },
          "plumb_bob, rational_polynomial or equidistant.")
      .def_property_readonly(
          "distortion", [](const CameraModel& c) { return c.distortion(); },
          "Coefficients, in the order of OpenCV.")
      .def(
          "project",
          [](const CameraModel& c, const Eigen::Vector3d& p_cam) { return c.project(p_cam).pixel; },
          py::arg("p_cam"), "The pixel (u, v) of a point of the camera frame, metres; NaN: none.")
      .def(
          "unproject",
          [](const CameraModel& c, const Eigen::Vector2d& pixel) { return c.unproject(pixel).xy; },
          py::arg("pixel"), "The ray (x, y, 1) through a pixel, as (x, y); NaN: none.");
}

void bind_laser(py::module_& module) {
  py::class_<Laser>(module, "Laser", "A laser plane in the camera frame: normal . p = distance.")
      .def_property_readonly("normal", [](const Laser& l) { return l.plane.normal(); })
      .def_property_readonly("distance_m", [](const Laser& l) { return l.plane.distance_m(); })
      .def_property_readonly(
          "width_px", [](const Laser& l) { return l.look.width_px; },
          "The stripe's Gaussian sigma; None where it was not measured.");
}

py::object covariance_of(const StriperModel& model) {
  if (!model.covariance) return py::none();
  return py::make_tuple(model.covariance->parameters, model.covariance->matrix);
}

}  // namespace

std::shared_ptr<const StriperModel> model_of(const py::object& given, const EventPort& events) {
  if (given.is_none()) return nullptr;
  if (py::isinstance<StriperModel>(given)) return given.cast<std::shared_ptr<StriperModel>>();
  const auto path = given.cast<std::filesystem::path>();
  const py::gil_scoped_release unlocked;
  return std::make_shared<const StriperModel>(load_model(path, events));
}

void bind_models(py::module_& module) {
  bind_camera(module);
  bind_laser(module);
  py::class_<StriperModel, std::shared_ptr<StriperModel>>(module, "Model", "A calibrated striper.")
      .def_property_readonly("camera", [](const StriperModel& m) { return m.camera; })
      .def_property_readonly("lasers", [](const StriperModel& m) { return m.lasers; })
      .def_property_readonly(
          "axis", [](const StriperModel& m) { return std::string(to_string(m.axis)); },
          "columns (one return a column) or rows.")
      .def_property_readonly(
          "channel", [](const StriperModel& m) { return std::string(to_string(m.channel)); },
          "What of colour images shows the stripe.")
      .def_property_readonly("covariance", covariance_of,
                             "(names, matrix) of all parameters; None where there is none.")
      .def(
          "T_cam_scan",
          [](const StriperModel& m, int laser) { return m.T_cam_scan(laser).matrix(); },
          py::arg("laser") = 0, "4x4: p_cam = T p_scan, metres.")
      .def("to_yaml", &format_model, "The text of its file.")
      .def(
          "save",
          [](const StriperModel& m, const std::filesystem::path& path) { save_model(m, path); },
          py::arg("path"), py::call_guard<py::gil_scoped_release>(),
          "Writes striper.yaml: whole or not at all.")
      .def("__repr__", text_of);
  module.def(
      "load_model",
      [](const std::filesystem::path& path, const py::object& on_event) {
        const EventPort events = port_of(on_event);
        const py::gil_scoped_release unlocked;
        return std::make_shared<StriperModel>(load_model(path, events));
      },
      py::arg("path"), py::kw_only(), py::arg("on_event") = py::none(),
      "Reads a model file, striper.yaml.");
}

}  // namespace striper::python
