// SPDX-License-Identifier: Apache-2.0
// Simulated frames with their truth.
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <striper/capture/source_uri.hpp>
#include <striper/simulator/simulated_source.hpp>

#include "bindings.hpp"
#include "waiting.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

// A scan line of the truth, as it is in arrays.
struct TrueRow {
  double u_px, v_px, bearing_rad, range_m, x_m, y_m, amplitude_dn, width_px;
  std::int32_t object;
  bool near_edge, blind, clipped, visible;
};

TrueRow row_of(const TrueLine& line) {
  const TrueReturn& r = line.brightest;
  return {r.u_px,
          r.v_px,
          r.bearing_rad,
          r.range_m,
          r.x_m,
          r.y_m,
          r.amplitude_dn,
          r.width_px,
          r.object,
          r.near_edge,
          r.blind,
          r.clipped,
          line.status == TruthStatus::kVisible};
}

py::array_t<TrueRow> rows_of(const Truth& truth) {
  py::array_t<TrueRow> rows(static_cast<py::ssize_t>(truth.lines.size()));
  TrueRow* to = rows.mutable_data();
  for (const TrueLine& line : truth.lines) *to++ = row_of(line);
  return rows;
}

std::vector<std::string> words_of(const Truth& truth) {
  std::vector<std::string> words;
  for (const TrueLine& line : truth.lines) words.emplace_back(to_string(line.status));
  return words;
}

// Frames and their truth, so many frames.
class Simulation {
 public:
  Simulation(std::unique_ptr<SimulatedSource> source, std::uint64_t frames)
      : source_(std::move(source)), left_(frames) {
    source_->start();
  }

  StriperModel model() const { return source_->simulator().model(); }

  py::tuple next() {
    auto frame = std::make_shared<Frame>();
    const auto next = [&](std::chrono::milliseconds time) {
      return left_ == 0 ? NextStatus::kEnd : source_->next(*frame, time);
    };
    if (wait_for_next(next, std::nullopt) != NextStatus::kFrame) throw py::stop_iteration();
    std::vector<Truth> truth = truth_of(*frame);
    handle_signals();
    return py::make_tuple(frame, truth.empty() ? py::none() : py::cast(std::move(truth.front())),
                          truth.size() < 2 ? py::none() : py::cast(std::move(truth.back())));
  }

 private:
  std::vector<Truth> truth_of(const Frame& frame) {
    const py::gil_scoped_release unlocked;
    left_ -= static_cast<std::uint64_t>(frame.is_interlaced() || frame.exposure_in_picture + 1 ==
                                                                     frame.exposures_per_picture);
    std::vector<Truth> truth = source_->simulator().truth(frame.sequence);
    if (frame.is_interlaced() || frame.exposures_per_picture == 1) return truth;
    std::erase_if(truth, [&](const Truth& t) { return t.field != frame.field; });
    return truth;
  }

  std::unique_ptr<SimulatedSource> source_;
  std::uint64_t left_;
};

std::unique_ptr<Simulation> simulate(const std::string& scene, std::uint64_t frames) {
  auto source =
      SimulatedSource::open(SourceUri::parse(scene.starts_with("sim:") ? scene : "sim:" + scene));
  return std::make_unique<Simulation>(std::move(source), frames);
}

}  // namespace

void bind_simulation(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(TrueRow, u_px, v_px, bearing_rad, range_m, x_m, y_m, amplitude_dn, width_px,
                       object, near_edge, blind, clipped, visible);
  py::class_<Truth>(module, "Truth", "Where the stripe is in one lit exposure, exactly.")
      .def_readonly("frame", &Truth::sequence)
      .def_readonly("time", &Truth::time_s)
      .def_readonly("laser", &Truth::laser)
      .def_property_readonly("lines", rows_of,
                             "A structured array, a row for every column (or row) of the image.")
      .def_property_readonly("status", words_of,
                             "Of each: visible, no_surface, shadowed, outside_fan, outside_model.");
  py::class_<Simulation>(module, "_Simulation")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Simulation::next)
      .def_property_readonly(
          "model", [](const Simulation& s) { return std::make_shared<StriperModel>(s.model()); });
  module.def("_simulate", simulate, py::arg("scene"), py::arg("frames"),
             py::call_guard<py::gil_scoped_release>());
}

}  // namespace striper::python
