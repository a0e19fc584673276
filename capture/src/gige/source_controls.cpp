// SPDX-License-Identifier: Apache-2.0
#include "gige/source_controls.hpp"

#include <initializer_list>
#include <limits>
#include <utility>

namespace striper::detail {
namespace {

ControlState number_state(const FeatureAccess& features, std::initializer_list<const char*> names) {
  const char* const name = features.first_of(names);
  if (name == nullptr) return {};
  const double value = features.number(name);
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const auto [least, most] = features.find_bounds(name).value_or(std::pair{-kAny, kAny});
  return {{value}, {least}, {most}};
}

ControlState region_state(const FeatureAccess& features) {
  ControlValue region;
  for (const char* const name : {"OffsetX", "OffsetY", "Width", "Height"}) {
    region.push_back(static_cast<double>(features.find_integer(name).value_or(0)));
  }
  return {region, region, region};
}

ControlRow exposure_row(const ControlledCamera& camera) {
  return {"exposure_us", ControlType::kNumber, "us",
          [camera] {
            return camera.session()->with_features([](const FeatureAccess& features) {
              return number_state(features, {"ExposureTime", "ExposureTimeAbs"});
            });
          },
          [camera](const ControlValue& value) {
            camera.session()->set_exposure_us(value[0]);
            camera.keep([&](KeptSettings& kept) { kept.exposure_us = value[0]; });
          }};
}

// GainRaw is in steps of the camera's own: not shown, since nobody knows how many dB they are.
ControlRow gain_row(const ControlledCamera& camera) {
  return {"gain_db", ControlType::kNumber, "dB",
          [camera] {
            return camera.session()->with_features([](const FeatureAccess& features) {
              return number_state(features, {"Gain", "GainAbs"});
            });
          },
          [camera](const ControlValue& value) {
            camera.session()->with_features(
                [&](const FeatureAccess& features) { set_gain(features, value[0]); });
            camera.keep([&](KeptSettings& kept) { kept.gain_db = value[0]; });
          }};
}

ControlRow laser_row(const ControlledCamera& camera) {
  return {"laser", ControlType::kSwitch, "",
          [camera]() -> ControlState {
            const auto session = camera.session();
            if (!session->has_lasers()) return {};
            return {{session->are_lasers_on() ? 1.0 : 0.0}, {0.0}, {1.0}};
          },
          [camera](const ControlValue& value) {
            // Kept first: a camera that is lost now stays dark when it is back.
            camera.keep([&](KeptSettings& kept) { kept.lasers_on = value[0] != 0.0; });
            camera.session()->switch_lasers(value[0] != 0.0);
          }};
}

ControlRow region_row(const ControlledCamera& camera) {
  return {"region", ControlType::kRegion, "px",
          [camera] { return camera.session()->with_features(region_state); }, nullptr};
}

}  // namespace

// The table: a control of a camera is a row here.
Controls make_controls(const std::string& source, const ControlledCamera& camera) {
  return {source, {exposure_row(camera), gain_row(camera), laser_row(camera), region_row(camera)}};
}

}  // namespace striper::detail
