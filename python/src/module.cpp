// SPDX-License-Identifier: Apache-2.0
#include "bindings.hpp"

PYBIND11_MODULE(_striper, module) {
  module.doc() = "What striper/__init__.py gives to programs.";
  module.attr("__version__") = STRIPER_VERSION;
  using namespace striper::python;
  bind_errors(module);
  bind_events(module);
  bind_models(module);
  bind_frames(module);
  bind_scans(module);
  bind_streams(module);
  bind_profiles(module);
  bind_curbs(module);
  bind_tracks(module);
  bind_designs(module);
  bind_simulation(module);
  bind_calibration(module);
}
