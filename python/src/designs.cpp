// SPDX-License-Identifier: Apache-2.0
// The figures of a striper before its parts are bought.
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <striper/design/design_figures.hpp>

#include "bindings.hpp"
#include "models.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

void bind_parts(py::module_& module) {
  py::class_<DesignLaser>(module, "DesignLaser", "The laser of a design: a fan of light.")
      .def_readwrite("origin_cam", &DesignLaser::origin_cam, "Where the fan begins, metres.")
      .def_readwrite("axis_cam", &DesignLaser::axis_cam, "Middle of the fan; unit length.")
      .def_readwrite("fan_rad", &DesignLaser::fan_rad)
      .def_readwrite("thickness_rad", &DesignLaser::thickness_rad)
      .def_readwrite("wavelength_nm", &DesignLaser::wavelength_nm)
      .def_readwrite("pulse_energy_j", &DesignLaser::pulse_energy_j, "Within a shutter opening.")
      .def_readwrite("pulse_s", &DesignLaser::pulse_s)
      .def_readwrite("power_w", &DesignLaser::power_w, "Of a steady laser, instead of pulses.");
  py::class_<DesignCamera>(module, "DesignCamera", "What turns light into numbers.")
      .def_readwrite("pixel_pitch_m", &DesignCamera::pixel_pitch_m)
      .def_readwrite("f_number", &DesignCamera::f_number)
      .def_readwrite("lens_transmission", &DesignCamera::lens_transmission)
      .def_readwrite("filter_transmission", &DesignCamera::filter_transmission)
      .def_readwrite("filter_width_nm", &DesignCamera::filter_width_nm)
      .def_readwrite("quantum_efficiency", &DesignCamera::quantum_efficiency)
      .def_readwrite("blur_sigma_px", &DesignCamera::blur_sigma_px)
      .def_readwrite("shutter_s", &DesignCamera::shutter_s)
      .def_readwrite("rate_hz", &DesignCamera::rate_hz)
      .def_readwrite("interlaced", &DesignCamera::interlaced)
      .def_readwrite("dark_subtracted", &DesignCamera::dark_subtracted)
      .def_readwrite("bit_depth", &DesignCamera::bit_depth)
      .def_readwrite("dn_per_electron", &DesignCamera::dn_per_electron)
      .def_readwrite("read_noise_e", &DesignCamera::read_noise_e)
      .def_readwrite("black_level_dn", &DesignCamera::black_level_dn);
  py::class_<DesignSun>(module, "DesignSun", "The light that disturbs.")
      .def_readwrite("total_w_m2", &DesignSun::total_w_m2)
      .def_readwrite("spectral_w_m2_nm", &DesignSun::spectral_w_m2_nm)
      .def_readwrite("suppression", &DesignSun::suppression);
}

void bind_design(py::module_& module) {
  py::class_<StriperDesign>(module, "StriperDesign",
                            "Everything that a design's figures are made of; by default the "
                            "striper of Mertz et al. 2002.")
      .def(py::init([](const py::object& model, int laser_index) {
             StriperDesign design;
             if (const auto given = model_of(model)) design.model = *given;
             design.laser_index = laser_index;
             return design;
           }),
           py::arg("model"), py::arg("laser_index") = 0)
      .def_readwrite("laser", &StriperDesign::laser)
      .def_readwrite("camera", &StriperDesign::camera)
      .def_readwrite("sun", &StriperDesign::sun)
      .def_readwrite("reflectance", &StriperDesign::reflectance, "Of the target, 0 to 1.")
      .def_readwrite("false_alarm", &StriperDesign::false_alarm)
      .def_readwrite("detection", &StriperDesign::detection);
}

void bind_figures(py::module_& module) {
  py::class_<RangeFigures>(module, "RangeFigures",
                           "What a design reaches at one place; NaN: not seen.")
      .def_readonly("range_m", &RangeFigures::range_m)
      .def_readonly("step_out_m", &RangeFigures::step_out_m, "One pixel of the image farther out.")
      .def_readonly("signal_dn", &RangeFigures::signal_dn)
      .def_readonly("background_dn", &RangeFigures::background_dn)
      .def_readonly("snr", &RangeFigures::snr)
      .def_readonly("width_px", &RangeFigures::width_px)
      .def_readonly("row_sigma_px", &RangeFigures::row_sigma_px)
      .def_readonly("sigma_m", &RangeFigures::sigma_m, "Predicted one-sigma error of the range.")
      .def_readonly("detection", &RangeFigures::detection, "Probability that the stripe is found.")
      .def_readonly("is_clipped", &RangeFigures::is_clipped);
  py::class_<DesignFigures>(module, "DesignFigures", "The numbers of a striper before it is built.")
      .def(py::init<StriperDesign>(), py::arg("design"))
      .def("at", &DesignFigures::at, py::arg("range_m"), py::arg("bearing_rad") = 0.0)
      .def_property_readonly("angular_resolution_rad", &DesignFigures::angular_resolution_rad)
      .def("coverage_rad", &DesignFigures::coverage_rad, py::arg("range_m"))
      .def_property_readonly("near_m", &DesignFigures::near_m)
      .def_property_readonly("far_m", &DesignFigures::far_m, "Infinite at a horizon.")
      .def_property_readonly("max_range_m", &DesignFigures::max_range_m,
                             "Where the stripe stops being found.")
      .def_property_readonly("scan_rate_hz", &DesignFigures::scan_rate_hz);
}

}  // namespace

void bind_designs(py::module_& module) {
  bind_parts(module);
  bind_design(module);
  bind_figures(module);
}

}  // namespace striper::python
