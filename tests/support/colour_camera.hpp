// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include <striper/core/frame.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/random_scene.hpp"

namespace striper::testing {

/// A colour camera before a simulated scene: the laser's light goes to its own channel and leaks a
/// little into the others, the rest of the light comes with a tint. Without the sensor's mosaic;
/// every channel has the scene's noise of its own.
class ColourCamera {
 public:
  enum class Laser { kRed, kGreen };

  ColourCamera(const Scene& scene, Laser colour);

  Frame render(std::uint64_t number);
  /// Of the laser's own channel, no noise and no clipping, CV_32FC1.
  cv::Mat expected_dn(std::uint64_t number);

 private:
  cv::Mat channel_dn(const cv::Mat& laser_dn, const cv::Mat& other_dn, int channel) const;

  Simulator laser_;  // All light is the laser's.
  Simulator other_;  // The laser is off.
  int own_ = 2;      // Blue, green, red as in OpenCV.
  std::array<double, 3> share_ = {};
  std::array<double, 3> tint_ = {};
};

}  // namespace striper::testing
