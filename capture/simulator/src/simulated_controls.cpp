// SPDX-License-Identifier: Apache-2.0
#include "simulated_controls.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace striper::detail {
namespace {

constexpr double kPerDegree = std::numbers::pi / 180.0;
constexpr double kShortest_us = 0.01;  // A pulsed laser's.
constexpr double kMostGain_dB = 48.0;  // A factor of 250: 8 bits become 16.
constexpr double kFarthest_m = 1e4;

Eigen::Isometry3d pose_of(const ControlValue& v) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
  pose.linear() = rotation_from_rpy(kPerDegree * v[3], kPerDegree * v[4], kPerDegree * v[5]);
  return pose;
}

// Yaw, pitch and roll of a rotation about the fixed axes x, y, z in that order (REP 103).
ControlValue value_of(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d& r = pose.linear();
  const Eigen::Vector3d& t = pose.translation();
  const double roll_rad = std::atan2(r(2, 1), r(2, 2));
  const double pitch_rad = std::atan2(-r(2, 0), std::hypot(r(2, 1), r(2, 2)));
  const double yaw_rad = std::atan2(r(1, 0), r(0, 0));
  return {t.x(), t.y(), t.z(), roll_rad / kPerDegree, pitch_rad / kPerDegree, yaw_rad / kPerDegree};
}

// A field is exposed for half a frame's time.
double longest_exposure_s(const Timing& timing) {
  return (timing.scan == ScanMode::kProgressive ? 1.0 : 0.5) / timing.picture_rate_hz;
}

ControlState state_of(double value, double minimum, double maximum) {
  return {{value}, {minimum}, {maximum}};
}

}  // namespace

template <typename Read>
std::function<ControlState()> SimulatedControls::locked(Read read) {
  return [this, read] {
    const std::lock_guard lock(mutex_);
    return read();
  };
}

template <typename Write>
std::function<void(const ControlValue&)> SimulatedControls::locked_write(Write write) {
  return [this, write](const ControlValue& value) {
    const std::lock_guard lock(mutex_);
    write(value);
    has_changed_ = true;
  };
}

ControlRow SimulatedControls::exposure_row(double longest_s) {
  const auto exposure_us = std::make_shared<double>(1e6 * wanted_.shutter_s);
  return {"exposure_us", ControlType::kNumber, "us", locked([exposure_us, longest_s] {
            return state_of(*exposure_us, kShortest_us, 1e6 * longest_s);
          }),
          locked_write([this, exposure_us](const ControlValue& v) {
            *exposure_us = v[0];
            wanted_.shutter_s = 1e-6 * v[0];
          })};
}

// Over what the scene says.
ControlRow SimulatedControls::gain_row(double dn_per_electron) {
  const auto gain_dB = std::make_shared<double>(0.0);
  return {"gain_db", ControlType::kNumber, "dB",
          locked([gain_dB] { return state_of(*gain_dB, 0.0, kMostGain_dB); }),
          locked_write([this, gain_dB, dn_per_electron](const ControlValue& v) {
            *gain_dB = v[0];
            wanted_.dn_per_electron = dn_per_electron * std::pow(10.0, v[0] / 20.0);
          })};
}

ControlRow SimulatedControls::laser_row() {
  return {"laser", ControlType::kSwitch, "",
          locked([this] { return state_of(wanted_.lasers_on ? 1.0 : 0.0, 0.0, 1.0); }),
          locked_write([this](const ControlValue& v) { wanted_.lasers_on = v[0] != 0.0; })};
}

ControlRow SimulatedControls::pose_row(std::size_t object, const std::string& name) {
  // As it was set: angles come back as they went in.
  const auto kept = std::make_shared<ControlValue>(value_of(wanted_.T_world_object[object]));
  return {"sim.pose." + name, ControlType::kPose, "", locked([kept] {
            constexpr double kFar = kFarthest_m;
            constexpr double kTurn = 360.0;
            return ControlState{*kept,
                                {-kFar, -kFar, -kFar, -kTurn, -kTurn, -kTurn},
                                {kFar, kFar, kFar, kTurn, kTurn, kTurn}};
          }),
          locked_write([this, kept, object](const ControlValue& v) {
            *kept = v;
            wanted_.T_world_object[object] = pose_of(v);
          })};
}  // NOLINT(clang-analyzer-cplusplus.NewDeleteLeaks): the row's functions share it.

// The table: a control of the simulator is a row here.
std::vector<ControlRow> SimulatedControls::rows(const Scene& scene) {
  const cv::Rect region = scene.imager.region;
  const ControlValue shown{static_cast<double>(region.x), static_cast<double>(region.y),
                           static_cast<double>(region.width), static_cast<double>(region.height)};
  std::vector<ControlRow> rows{
      exposure_row(longest_exposure_s(scene.timing)),
      gain_row(scene.imager.dn_per_electron),
      laser_row(),
      {"region", ControlType::kRegion, "px",
       [shown] {
         return ControlState{shown, shown, shown};
       },
       nullptr},
  };
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const std::string& name = scene.objects[i].name;
    const auto has_name = [&](const SceneObject& object) { return object.name == name; };
    const auto count = std::count_if(scene.objects.begin(), scene.objects.end(), has_name);
    if (count == 1 && !name.empty()) rows.push_back(pose_row(i, name));
  }
  return rows;
}

SimulatedControls::SimulatedControls(const std::string& source, const Scene& scene)
    : wanted_(SceneSettings::of(scene)), controls_(source, rows(scene)) {}

void SimulatedControls::apply_to(Simulator& simulator) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(has_changed_, false)) simulator.apply(wanted_);
}

}  // namespace striper::detail
