// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace striper {

/// The lens models of ROS camera_info.
enum class LensModel {
  kPlumbBob,            ///< Brown-Conrady: k1 k2 p1 p2 k3. Brown 1966; OpenCV's 5-parameter model.
  kRationalPolynomial,  ///< OpenCV's 8-parameter rational model: k1 k2 p1 p2 k3 k4 k5 k6.
  kEquidistant,  ///< Kannala-Brandt: k1 k2 k3 k4 in theta. Kannala & Brandt 2006; OpenCV fisheye.
};

/// `plumb_bob`, `rational_polynomial` or `equidistant`. Static storage.
std::string_view to_string(LensModel lens) noexcept;

/// The inverse; empty for a word that is none of them.
std::optional<LensModel> lens_model_from_string(std::string_view word) noexcept;

/// Number of distortion coefficients: 5, 8 or 4.
int distortion_count(LensModel lens) noexcept;

/// Why a pixel has no ray, or a point no pixel.
enum class CameraStatus {
  kOk,
  kBehindCamera,  ///< The point is behind the camera, or the ray would not have z > 0.
  kBeyondModel,   ///< The distortion is not one-to-one here: beyond the radius where it folds back.
};

/// The result of `CameraModel::unproject`. `xy` is (X/Z, Y/Z), NaN unless `status` is kOk.
struct Unprojection {
  Eigen::Vector2d xy;
  CameraStatus status;
};

/// The result of `CameraModel::project`. `pixel` is (u, v), NaN unless `status` is kOk.
struct Projection {
  Eigen::Vector2d pixel;
  CameraStatus status;
};

/// Maps points of the camera frame (x right, y down, z forward, metres) to full-sensor pixels ((0,
/// 0) is the centre of the top-left pixel) and back. A value; immutable once made; all functions
/// are thread-safe.
class CameraModel {
 public:
  /// A pinhole of one pixel; exists so that aggregates can be filled in.
  CameraModel() = default;

  /// @param distortion exactly `distortion_count(lens)` coefficients, in OpenCV's order.
  /// @throws Error{kBadValue} on a size or focal length that is not positive, a non-finite number,
  /// or a
  ///         wrong number of coefficients; the message names the quantity and its value.
  CameraModel(int width, int height, double fx, double fy, double cx, double cy,
              LensModel lens = LensModel::kPlumbBob, std::vector<double> distortion = {});

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  double fx() const noexcept { return fx_; }
  double fy() const noexcept { return fy_; }
  double cx() const noexcept { return cx_; }
  double cy() const noexcept { return cy_; }
  LensModel lens() const noexcept { return lens_; }
  const std::vector<double>& distortion() const noexcept { return distortion_; }

  /// fx, fy, cx, cy and the distortion: the order of the columns of every Jacobian and covariance.
  Eigen::VectorXd parameters() const;
  /// The names of `parameters()`, as in the model file's covariance block: fx, fy, cx, cy, k1, ...
  std::vector<std::string_view> parameter_names() const;
  /// The same camera with other parameters. @throws Error{kBadValue} like the constructor.
  CameraModel with_parameters(const Eigen::VectorXd& parameters) const;

  /// Projects a point. About 20 ns; no allocation.
  Projection project(const Eigen::Vector3d& p_cam) const noexcept;

  /// Projects a point and differentiates.
  /// @param J_point 2x3, d pixel / d p_cam; @param J_parameters 2xN, d pixel / d parameters. Either
  /// may be null.
  Projection project(const Eigen::Vector3d& p_cam, Eigen::Matrix<double, 2, 3>* J_point,
                     Eigen::Matrix<double, 2, Eigen::Dynamic>* J_parameters) const;

  /// Finds the ray through a pixel: Newton's method on the distortion inside a shrinking bracket,
  /// then in two dimensions where there are tangential terms. The round trip project(unproject(q))
  /// is q to 1e-9 px wherever the model is one-to-one. 20 to 300 ns, some microseconds for a pixel
  /// beyond a fold; no allocation. A rational lens with a pole and tangential terms above 0.01 (no
  /// real one) may report kBeyondModel on a few pixels that have a ray, close to the pole.
  Unprojection unproject(const Eigen::Vector2d& pixel) const noexcept;

  /// The largest angle from the optical axis, radians, up to which the lens model is one-to-one in
  /// every direction: the first zero of its radial derivative, a little less with tangential terms;
  /// pi/2 (exclusive) at most, since a ray is written (x, y, 1).
  double max_theta_rad() const noexcept;

  /// True where some pixel of the image has no ray: the distortion folds back inside the image.
  bool folds_inside_image() const noexcept;

  friend bool operator==(const CameraModel&, const CameraModel&) = default;

 private:
  bool is_tangential() const noexcept;
  bool is_one_to_one_at(const Eigen::Vector2d& xy) const noexcept;
  CameraStatus beyond() const noexcept;
  Unprojection undistort_radial(const Eigen::Vector2d& distorted) const noexcept;
  Unprojection undistort_tangential(const Eigen::Vector2d& distorted) const noexcept;

  int width_ = 1;
  int height_ = 1;
  double fx_ = 1.0;
  double fy_ = 1.0;
  double cx_ = 0.0;
  double cy_ = 0.0;
  LensModel lens_ = LensModel::kPlumbBob;
  std::vector<double> distortion_ = {0.0, 0.0, 0.0, 0.0, 0.0};
  double max_radius_ = 1e6;  ///< tan(max_theta_rad()).
};

}  // namespace striper
