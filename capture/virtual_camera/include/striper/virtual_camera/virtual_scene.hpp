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
  /// How long its frames are exposed where nobody says otherwise.
  virtual double shutter_us() const { return 1000.0; }
  /// What the lasers do while no client commands them.
  virtual IlluminationPattern pattern() const = 0;

  /// The whole sensor's image number `n` (CV_8UC1 or CV_16UC1) with this laser, or none, on.
  /// Called from one thread; the result is valid until the next call.
  /// @param exposure_us 0: `shutter_us`. Longer than from frame to frame is as long as that.
  virtual cv::Mat image(std::uint64_t n, Illumination light, double exposure_us = 0.0) = 0;
};

/// The simulator's scene. Image n is bit for bit image n of `sim:` with a pattern that has the
/// same light, and exposure, there. @throws Error as Simulator does.
std::shared_ptr<VirtualScene> make_virtual_scene(const Scene& scene);

/// The first `count` images of another scene, over and over, made in advance: for frame rates at
/// which they cannot be computed. Their exposure is the scene's, whatever is asked for.
std::shared_ptr<VirtualScene> make_looped_scene(std::shared_ptr<VirtualScene> scene, int count);

}  // namespace striper
