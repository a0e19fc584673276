// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>

#include <striper/core/frame.hpp>
#include <striper/model/striper_model.hpp>
#include <striper/simulator/scene.hpp>
#include <striper/simulator/truth.hpp>

namespace striper {

/// What of a scene may change from one frame to the next.
struct SceneSettings {
  double shutter_s = 0.0;
  double dn_per_electron = 0.0;
  bool lasers_on = true;  ///< Off: every exposure is dark, whatever the pattern says.
  std::vector<Eigen::Isometry3d> T_world_object;  ///< Of each object, at time zero.

  static SceneSettings of(const Scene& scene);
};

/// Renders what a striper's camera sees in a scene, and tells the truth about it.
///
/// Every frame can be asked for in any order and is always the same: the noise is a function of
/// the seed, the exposure's number and the pixel. All arithmetic of the noise is written out, so it
/// is the same on every machine.
///
/// Light: the laser's fluence and the daylight's irradiance on each surface, Lambert's law, the
/// lens, filter and sensor of `Imager`; shadows on the laser's and the sun's side, occlusion on the
/// camera's. The stripe is integrated over each pixel in closed form on a grid of 4 x 4 cells a
/// pixel, the lens blur included; daylight is sampled once a pixel and 8 x 8 times on edges.
/// Motion during the shutter time is left out.
///
/// Cost: about 50 ms until the first image of 640x480; a static scene is rendered once, and then an
/// image is only its noise. Not thread-safe: one Simulator per thread.
class Simulator {
 public:
  /// @throws Error{kBadValue} where the scene is not valid, naming the field.
  explicit Simulator(Scene scene);
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;
  ~Simulator();

  const Scene& scene() const noexcept;

  /// Changes the scene for all that is asked for from now on. @param settings one pose an object.
  /// @throws Error{kBadValue} where the scene would not be valid; then it stays as it was.
  void apply(const SceneSettings& settings);

  /// 1, or 2 where the scan is interlaced.
  int exposures_per_picture() const noexcept;
  /// Parts in which `render` gives one frame: 2 only where fields come one by one.
  int parts_per_frame() const noexcept;

  /// Renders a frame. @param part which of its fields, where they come one by one.
  Frame render(std::uint64_t sequence, int part = 0);

  /// The same without any noise, clipping or rounding: expected DN, CV_32FC1.
  cv::Mat expected_dn(std::uint64_t sequence, int part = 0);

  /// The truth of every exposure of a frame that a laser lights (none, one, or two fields).
  std::vector<Truth> truth(std::uint64_t sequence);

  /// The striper as a perfect calibration would find it: camera, planes, axis, noise, and what its
  /// stripes look like at all ranges that the image shows (`ideal_look`). No covariance.
  StriperModel model() const;

  /// Middle of an exposure, seconds after that of the first. @param exposure 0 or 1.
  double time_s(std::uint64_t sequence, int exposure = 0) const noexcept;

  /// Where an object is in the camera's frame during an exposure: a board's pose, for example.
  /// @throws Error{kBadValue} where there is no such object.
  Eigen::Isometry3d T_cam_object(int object, std::uint64_t sequence, int exposure = 0) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
