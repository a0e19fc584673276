// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace striper::python {

// Each adds one part of the library to the module `striper._striper`, in this order.
void bind_errors(pybind11::module_& module);
void bind_events(pybind11::module_& module);
void bind_models(pybind11::module_& module);
void bind_frames(pybind11::module_& module);
void bind_scans(pybind11::module_& module);
void bind_streams(pybind11::module_& module);
void bind_profiles(pybind11::module_& module);
void bind_curbs(pybind11::module_& module);
void bind_tracks(pybind11::module_& module);
void bind_designs(pybind11::module_& module);
void bind_simulation(pybind11::module_& module);
void bind_calibration(pybind11::module_& module);

}  // namespace striper::python
