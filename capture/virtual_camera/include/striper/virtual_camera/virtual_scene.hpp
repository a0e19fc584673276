// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include <opencv2/core/mat.hpp>

#include <striper/core/illumination.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/simulator/scene.hpp>

namespace striper {

/// What a virtual camera looks at.
class VirtualScene {
 public:
  virtual ~VirtualScene() = default;

  virtual cv::Size sensor_size() const = 0;
  virtual int bit_depth() const = 0;
  virtual double rate_hz() const = 0;
  /// What the lasers do while no client commands them.
  virtual IlluminationPattern pattern() const = 0;

  /// The whole sensor's picture number `n` (CV_8UC1 or CV_16UC1) with this laser, or none, on.
  /// Called from one thread; the result is valid until the next call.
  virtual cv::Mat picture(std::uint64_t n, Illumination light) = 0;
};

/// The simulator's scene. Picture n is bit for bit picture n of `sim:` with a pattern that has the
/// same light there. @throws Error as Simulator does.
std::shared_ptr<VirtualScene> make_virtual_scene(const Scene& scene);

/// The first `count` pictures of another scene, over and over, made in advance: for frame rates at
/// which they cannot be computed.
std::shared_ptr<VirtualScene> make_looped_scene(std::shared_ptr<VirtualScene> scene, int count);

}  // namespace striper
