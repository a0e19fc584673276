// SPDX-License-Identifier: Apache-2.0
// What is tracked from scan to scan: curbs, objects.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <striper/detect/curb_detector.hpp>
#include <striper/detect/objects.hpp>

#include "bindings.hpp"
#include "models.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

// Tracks are copied: the detector's are valid until its next scan only.
template <typename Track, typename Detector>
std::vector<Track> update(Detector& detector, const PolarScan& scan,
                          const std::optional<Motion>& motion) {
  const py::gil_scoped_release unlocked;
  const auto tracks = detector.update(scan, motion);
  return {tracks.begin(), tracks.end()};
}

void bind_motion(py::module_& module) {
  py::class_<Motion>(module, "Motion",
                     "How a vehicle has moved since the first reading; NaN: not known.")
      .def(py::init([](double distance_m, double speed_m_s, double yaw_rad, double yaw_rate_rad_s) {
             Motion motion;
             motion.distance_m = distance_m;
             motion.speed_m_s = speed_m_s;
             motion.yaw_rad = yaw_rad;
             motion.yaw_rate_rad_s = yaw_rate_rad_s;
             return motion;
           }),
           py::kw_only(), py::arg("distance_m"), py::arg("speed_m_s") = Motion::kUnknown,
           py::arg("yaw_rad") = Motion::kUnknown, py::arg("yaw_rate_rad_s") = Motion::kUnknown)
      .def_readwrite("distance_m", &Motion::distance_m, "Along its own path.")
      .def_readwrite("speed_m_s", &Motion::speed_m_s)
      .def_readwrite("yaw_rad", &Motion::yaw_rad, "Counter-clockwise from above, not wrapped.")
      .def_readwrite("yaw_rate_rad_s", &Motion::yaw_rate_rad_s);
}

void bind_curb_track(py::module_& module) {
  py::class_<CurbTrack>(module, "CurbTrack", "A curb at one scan, as all scans so far say.")
      .def_readonly("id", &CurbTrack::id)
      .def_property_readonly(
          "kind", [](const CurbTrack& t) { return std::string(to_string(t.kind)); },
          "up, down or ramp, which is no curb.")
      .def_property_readonly(
          "state", [](const CurbTrack& t) { return std::string(to_string(t.state)); },
          "new, tracked or hidden.")
      .def_readonly("foot_m", &CurbTrack::foot_m, "(x, y) where road meets face, scan frame.")
      .def_readonly("top_m", &CurbTrack::top_m, "(x, y) where face meets top.")
      .def_readonly("lateral_m", &CurbTrack::lateral_m, "Of the foot along the road's line.")
      .def_readonly("sigma_lateral_m", &CurbTrack::sigma_lateral_m)
      .def_readonly("sigma_cal_lateral_m", &CurbTrack::sigma_cal_lateral_m,
                    "The calibration's, common to all scans.")
      .def_readonly("height_m", &CurbTrack::height_m)
      .def_readonly("sigma_height_m", &CurbTrack::sigma_height_m)
      .def_readonly("sigma_cal_height_m", &CurbTrack::sigma_cal_height_m)
      .def_readonly("slope", &CurbTrack::slope, "Lateral metres a metre of way.")
      .def_readonly("sigma_slope", &CurbTrack::sigma_slope)
      .def_readonly("way_m", &CurbTrack::way_m, "From the scan that saw it first.")
      .def_readonly("hits", &CurbTrack::hits, "Scans that saw it.")
      .def_readonly("confidence", &CurbTrack::confidence, "Probability that it is a curb.");
}

std::unique_ptr<CurbDetector> make_detector(std::optional<double> up_rad, double min_height_m,
                                            double max_height_m, double speed_m_s,
                                            const py::object& model) {
  CurbDetectorOptions options;
  options.curb.up_rad = up_rad;
  options.curb.min_height_m = min_height_m;
  options.curb.max_height_m = max_height_m;
  options.speed_m_s = speed_m_s;
  return std::make_unique<CurbDetector>(options, model_of(model));
}

void bind_curb_detector(py::module_& module) {
  const CurbDetectorOptions defaults;
  py::class_<CurbDetector>(module, "CurbDetector",
                           "Follows curbs along the way; one for each laser plane.")
      .def(py::init(&make_detector), py::kw_only(), py::arg("up_rad") = defaults.curb.up_rad,
           py::arg("min_height_m") = defaults.curb.min_height_m,
           py::arg("max_height_m") = defaults.curb.max_height_m,
           py::arg("speed_m_s") = defaults.speed_m_s, py::arg("model") = py::none())
      .def("update", &update<CurbTrack, CurbDetector>, py::arg("scan"),
           py::arg("motion") = py::none(), "Takes the next scan, in the order of time.");
}

void bind_object_track(py::module_& module) {
  py::class_<ObjectTrack>(module, "ObjectTrack", "An object at one scan; NaN: not known.")
      .def_readonly("id", &ObjectTrack::id)
      .def_readonly("is_seen", &ObjectTrack::is_seen, "In this scan; else it is predicted.")
      .def_readonly("hits", &ObjectTrack::hits, "Scans that saw it.")
      .def_readonly("scans", &ObjectTrack::scans, "Scans since the first.")
      .def_readonly("position_m", &ObjectTrack::position_m, "(x, y) of its closest point.")
      .def_readonly("covariance", &ObjectTrack::covariance, "2x2, of that.")
      .def_readonly("width_m", &ObjectTrack::width_m)
      .def_readonly("velocity_m_s", &ObjectTrack::velocity_m_s,
                    "(x, y), over ground where there is motion, else relative.")
      .def_readonly("sigma_v_m_s", &ObjectTrack::sigma_v_m_s, "Along observable_rad.")
      .def_readonly("observable_rad", &ObjectTrack::observable_rad)
      .def_readonly("is_fully_observed", &ObjectTrack::is_fully_observed)
      .def_readonly("closing_m_s", &ObjectTrack::closing_m_s)
      .def_readonly("sigma_closing_m_s", &ObjectTrack::sigma_closing_m_s)
      .def_readonly("time_to_contact_s", &ObjectTrack::time_to_contact_s)
      .def_readonly("ttc_low_s", &ObjectTrack::ttc_low_s, "95 % lie between this")
      .def_readonly("ttc_high_s", &ObjectTrack::ttc_high_s, "and this.")
      .def_property_readonly(
          "zone", [](const ObjectTrack& t) { return std::string(to_string(t.zone)); },
          "road, behind_curb or unknown.")
      .def_readonly("confidence", &ObjectTrack::confidence, "Probability that it exists.");
}

/// An ObjectTracker, and what finds its ground where the scan plane cuts one.
class Tracker {
 public:
  Tracker(std::optional<double> up_rad, double forward_rad, std::optional<double> roughness_m,
          std::optional<double> acceleration_m_s2, double speed_m_s)
      : tracker_(options_of(forward_rad, roughness_m, acceleration_m_s2)) {
    if (!up_rad) return;
    CurbDetectorOptions street;
    street.curb.up_rad = up_rad;
    street.speed_m_s = speed_m_s;
    street_.emplace(street);
  }

  std::span<const ObjectTrack> update(const PolarScan& scan, const std::optional<Motion>& motion) {
    if (street_) {
      street_->update(scan, motion);
      tracker_.set_street(*street_);
    }
    return tracker_.update(scan, motion);
  }

 private:
  // What is told is not learnt.
  static ObjectOptions options_of(double forward_rad, std::optional<double> roughness_m,
                                  std::optional<double> acceleration_m_s2) {
    ObjectOptions options;
    options.forward_rad = forward_rad;
    options.learns = !roughness_m && !acceleration_m_s2;
    options.roughness_m = roughness_m.value_or(options.roughness_m);
    options.acceleration_m_s2 = acceleration_m_s2.value_or(options.acceleration_m_s2);
    return options;
  }

  ObjectTracker tracker_;
  std::optional<CurbDetector> street_;  // Where the scan plane cuts a road.
};

void bind_object_tracker(py::module_& module) {
  py::class_<Tracker>(module, "ObjectTracker",
                      "Follows what stands or moves in the scan plane; one for each laser plane.")
      .def(py::init<std::optional<double>, double, std::optional<double>, std::optional<double>,
                    double>(),
           py::kw_only(), py::arg("up_rad") = py::none(), py::arg("forward_rad") = 0.0,
           py::arg("roughness_m") = py::none(), py::arg("acceleration_m_s2") = py::none(),
           py::arg("speed_m_s") = CurbDetectorOptions{}.speed_m_s)
      .def("update", &update<ObjectTrack, Tracker>, py::arg("scan"), py::arg("motion") = py::none(),
           "Takes the next scan, in the order of time.");
}

}  // namespace

void bind_tracks(py::module_& module) {
  bind_motion(module);
  bind_curb_track(module);
  bind_curb_detector(module);
  bind_object_track(module);
  bind_object_tracker(module);
}

}  // namespace striper::python
