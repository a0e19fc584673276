// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Core>
#include <Eigen/LU>
#include <fmt/format.h>
#include <unsupported/Eigen/AutoDiff>

#include <striper/core/error.hpp>
#include <striper/model/camera_model.hpp>
#include <striper/model/projection.hpp>

#include "model/polynomial.hpp"

namespace striper {
namespace {

using detail::Polynomial;

// A ray is written (x, y, 1): this far out it is a microradian from square to the optical axis.
constexpr double kMaxRadius = 1e6;
constexpr int kMaxImageSize = 100'000;
constexpr double kMaxCoefficient = 1e9;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

constexpr std::array<std::pair<LensModel, std::string_view>, 3> kWords{{
    {LensModel::kPlumbBob, "plumb_bob"},
    {LensModel::kRationalPolynomial, "rational_polynomial"},
    {LensModel::kEquidistant, "equidistant"},
}};

constexpr std::array<std::string_view, 8> kBrownNames{"k1", "k2", "p1", "p2",
                                                      "k3", "k4", "k5", "k6"};
constexpr std::array<std::string_view, 4> kEquidistantNames{"k1", "k2", "k3", "k4"};

void require(bool is_good, std::string_view quantity, double value, std::string_view expected) {
  if (is_good) return;
  throw Error(ErrorKind::kBadValue,
              fmt::format("camera: {} is {} - expected {}", quantity, value, expected));
}

void require_size(std::string_view quantity, int pixels) {
  require(pixels > 0 && pixels <= kMaxImageSize, quantity, pixels,
          fmt::format("1 to {} pixels", kMaxImageSize));
}

void require_focal_length(std::string_view quantity, double pixels) {
  require(std::isfinite(pixels) && pixels > 0.0, quantity, pixels, "a finite number above 0");
}

// Where a lens of the Brown family folds along one ray from the image centre. f = r N / D is its
// radial part, f' = Q / D^2. Turned so that the ray is the x axis, the tangential coefficients are
// `along` (p2) and `across` (p1), and the determinant of the distortion's Jacobian at (r, 0) is
// (f' + 6 along r)(N / D + 2 along r) - (2 across r)^2, here times D^3.
class BrownFold {
 public:
  BrownFold(LensModel lens, const double* k) noexcept : n_{1.0, 0.0, k[0], 0.0, k[1], 0.0, k[4]} {
    if (lens == LensModel::kRationalPolynomial) d_ = {1.0, 0.0, k[5], 0.0, k[6], 0.0, k[7]};
    const Polynomial r{0.0, 1.0};
    q_ = (r * n_).derivative() * d_ + -1.0 * (r * n_ * d_.derivative());
  }

  // The radius up to which the determinant is positive.
  double radius(double along, double across) const noexcept {
    // A hair before the pole: on it the quotient may have either sign.
    const double root = d_.positive_until(kMaxRadius);
    const double pole = root < kMaxRadius ? root * (1.0 - 1e-12) : kMaxRadius;
    if (along == 0.0 && across == 0.0) return q_.positive_until(pole);
    const Polynomial r{0.0, 1.0};
    const Polynomial determinant =
        (q_ + 6.0 * along * (r * d_ * d_)) * (n_ + 2.0 * along * r * d_) +
        -4.0 * across * across * (r * r * d_ * d_ * d_);
    return determinant.positive_until(pole);
  }

 private:
  Polynomial n_;
  Polynomial d_{1.0};
  Polynomial q_;
};

// Up to this radius the lens is one-to-one in every direction.
double one_to_one_radius(LensModel lens, const double* k) noexcept {
  if (lens == LensModel::kEquidistant) {
    const Polynomial slope{1.0, 0.0, 3.0 * k[0], 0.0, 5.0 * k[1], 0.0, 7.0 * k[2], 0.0, 9.0 * k[3]};
    const double limit = std::atan(kMaxRadius);
    const double theta = slope.positive_until(limit);
    return theta < limit ? std::tan(theta) : kMaxRadius;
  }
  // The worst that tangential terms can do in any direction, so that one polynomial bounds all.
  const double tangential = std::hypot(k[2], k[3]);
  return BrownFold(lens, k).radius(-tangential, tangential);
}

// A number and its derivative.
using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 1, 1>>;

std::array<Dual, 8> constants(const std::vector<double>& k) noexcept {
  std::array<Dual, 8> result;
  for (std::size_t i = 0; i < k.size(); ++i) result[i] = Dual(k[i]);
  return result;
}

// Solves f(x) = target on [0, high] for an increasing f: Newton's method inside a bracket, which is
// halved wherever Newton would leave it or does not halve its step (it can run in circles).
template <typename Function>
double invert_increasing(const Function& f, double target, double high) noexcept {
  constexpr int kMaxSteps = 200;
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  double low = 0.0;
  double x = std::min(target, 0.5 * high);
  double step = high;
  for (int i = 0; i < kMaxSteps; ++i) {
    const Dual value = f(Dual(x, 1, 0));
    const double error = value.value() - target;
    if (std::abs(error) <= kEpsilon * target) break;
    (error > 0.0 ? high : low) = x;
    const double last_step = std::abs(step);
    step = -error / value.derivatives()[0];
    const bool is_good = x + step > low && x + step < high && std::abs(step) <= 0.5 * last_step;
    if (!is_good) step = 0.5 * (low + high) - x;
    if (std::abs(step) <= 0.5 * kEpsilon * x) break;
    x += step;
  }
  return x;
}

// Where the search for a distorted point ended.
struct Solution {
  Eigen::Vector2d xy;
  bool is_converged;
};

// Solves distort(xy) = target near `start`: Newton's method whose step is halved until it brings
// the point nearer and stays where the lens has not folded.
Solution invert_distortion(LensModel lens, const std::vector<double>& coefficients,
                           const Eigen::Vector2d& target, const Eigen::Vector2d& start) noexcept {
  using Scalar = Eigen::AutoDiffScalar<Eigen::Vector2d>;
  using Point = Eigen::Matrix<Scalar, 2, 1>;
  constexpr int kMaxSteps = 100;
  const double tolerance = 1e-15 * (1.0 + target.norm());
  std::array<Scalar, 8> k;
  for (std::size_t i = 0; i < coefficients.size(); ++i) k[i] = Scalar(coefficients[i]);
  Eigen::Vector2d xy = start;
  Eigen::Vector2d best = start;
  Eigen::Vector2d step = Eigen::Vector2d::Zero();
  double best_error = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMaxSteps; ++i) {
    const Point value = distort(lens, k.data(), Point(Scalar(xy.x(), 2, 0), Scalar(xy.y(), 2, 1)));
    const Eigen::Vector2d error(value.x().value() - target.x(), value.y().value() - target.y());
    Eigen::Matrix2d J;
    J << value.x().derivatives().transpose(), value.y().derivatives().transpose();
    if (error.norm() < best_error && J.determinant() > 0.0) {
      best = xy;
      best_error = error.norm();
      step = J.inverse() * error;
      if (best_error <= tolerance) break;
    } else {
      step *= 0.5;
      if (step.norm() <= 1e-17 * (1.0 + best.norm())) break;
    }
    xy = best - step;
  }
  return {best, best_error <= 1e3 * tolerance};
}

}  // namespace

std::string_view to_string(LensModel lens) noexcept {
  for (const auto& [value, word] : kWords) {
    if (value == lens) return word;
  }
  return {};
}

std::optional<LensModel> lens_model_from_string(std::string_view word) noexcept {
  for (const auto& [value, text] : kWords) {
    if (text == word) return value;
  }
  return std::nullopt;
}

int distortion_count(LensModel lens) noexcept {
  switch (lens) {
    case LensModel::kPlumbBob:
      return 5;
    case LensModel::kRationalPolynomial:
      return 8;
    case LensModel::kEquidistant:
      break;
  }
  return 4;
}

// The standard order of a pinhole camera's numbers. NOLINTNEXTLINE(readability-function-size)
CameraModel::CameraModel(int width, int height, double fx, double fy, double cx, double cy,
                         LensModel lens, std::vector<double> distortion)
    : width_(width),
      height_(height),
      fx_(fx),
      fy_(fy),
      cx_(cx),
      cy_(cy),
      lens_(lens),
      distortion_(std::move(distortion)) {
  const auto count = static_cast<std::size_t>(distortion_count(lens));
  if (distortion_.empty()) distortion_.assign(count, 0.0);
  require_size("image width", width);
  require_size("image height", height);
  require_focal_length("focal length fx", fx);
  require_focal_length("focal length fy", fy);
  require(std::isfinite(cx), "principal point cx", cx, "a finite number");
  require(std::isfinite(cy), "principal point cy", cy, "a finite number");
  require(distortion_.size() == count, "number of distortion coefficients",
          static_cast<double>(distortion_.size()),
          fmt::format("{} for {}", count, to_string(lens)));
  for (std::size_t i = 0; i < count; ++i) {
    require(std::abs(distortion_[i]) <= kMaxCoefficient,
            fmt::format("distortion coefficient {}", parameter_names()[4 + i]), distortion_[i],
            fmt::format("a finite number of magnitude up to {}", kMaxCoefficient));
  }
  max_radius_ = one_to_one_radius(lens_, distortion_.data());
}

Eigen::VectorXd CameraModel::parameters() const {
  Eigen::VectorXd result(4 + static_cast<Eigen::Index>(distortion_.size()));
  result << fx_, fy_, cx_, cy_,
      Eigen::Map<const Eigen::VectorXd>(distortion_.data(),
                                        static_cast<Eigen::Index>(distortion_.size()));
  return result;
}

std::vector<std::string_view> CameraModel::parameter_names() const {
  std::vector<std::string_view> names{"fx", "fy", "cx", "cy"};
  for (std::size_t i = 0; i < distortion_.size(); ++i) {
    names.push_back(lens_ == LensModel::kEquidistant ? kEquidistantNames[i] : kBrownNames[i]);
  }
  return names;
}

CameraModel CameraModel::with_parameters(const Eigen::VectorXd& parameters) const {
  const Eigen::Index count = 4 + distortion_count(lens_);
  require(parameters.size() == count, "number of parameters",
          static_cast<double>(parameters.size()), fmt::format("{}", count));
  return {width_,        height_,
          parameters[0], parameters[1],
          parameters[2], parameters[3],
          lens_,         std::vector<double>(parameters.data() + 4, parameters.data() + count)};
}

double CameraModel::max_theta_rad() const noexcept { return std::atan(max_radius_); }

bool CameraModel::is_tangential() const noexcept {
  return lens_ != LensModel::kEquidistant && (distortion_[2] != 0.0 || distortion_[3] != 0.0);
}

CameraStatus CameraModel::beyond() const noexcept {
  return max_radius_ < kMaxRadius ? CameraStatus::kBeyondModel : CameraStatus::kBehindCamera;
}

bool CameraModel::is_one_to_one_at(const Eigen::Vector2d& xy) const noexcept {
  const double r2 = xy.squaredNorm();
  if (r2 <= max_radius_ * max_radius_) return true;
  if (!is_tangential() || !(r2 <= kMaxRadius * kMaxRadius)) return false;
  // Where the tangential terms decide, look along this very ray.
  const double r = std::sqrt(r2);
  const double p1 = distortion_[2];
  const double p2 = distortion_[3];
  const double along = (p2 * xy.x() + p1 * xy.y()) / r;
  const double across = (p1 * xy.x() - p2 * xy.y()) / r;
  return r <= BrownFold(lens_, distortion_.data()).radius(along, across);
}

Projection CameraModel::project(const Eigen::Vector3d& p_cam) const noexcept {
  const Eigen::Vector2d nothing(kNan, kNan);
  if (!(p_cam.z() > 0.0)) return {nothing, CameraStatus::kBehindCamera};
  const Eigen::Vector2d xy = p_cam.head<2>() / p_cam.z();
  if (!is_one_to_one_at(xy)) return {nothing, beyond()};
  const Eigen::Vector2d distorted = distort(lens_, distortion_.data(), xy);
  return {{fx_ * distorted.x() + cx_, fy_ * distorted.y() + cy_}, CameraStatus::kOk};
}

Projection CameraModel::project(const Eigen::Vector3d& p_cam, Eigen::Matrix<double, 2, 3>* J_point,
                                Eigen::Matrix<double, 2, Eigen::Dynamic>* J_parameters) const {
  constexpr int kMaxParameters = 12;
  using Scalar = Eigen::AutoDiffScalar<Eigen::Matrix<double, 3 + kMaxParameters, 1>>;
  const int count = 4 + distortion_count(lens_);
  if (J_point != nullptr) J_point->setConstant(kNan);
  if (J_parameters != nullptr) J_parameters->setConstant(2, count, kNan);
  Projection result = project(p_cam);
  if (result.status != CameraStatus::kOk) return result;

  constexpr int kInputs = 3 + kMaxParameters;
  Eigen::Matrix<Scalar, 3, 1> point;
  for (int i = 0; i < 3; ++i) point[i] = Scalar(p_cam[i], kInputs, i);
  const std::array<double, 4> pinhole{fx_, fy_, cx_, cy_};
  std::array<Scalar, kMaxParameters> parameters;
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    parameters[at] = Scalar(i < 4 ? pinhole[at] : distortion_[at - 4], kInputs, 3 + i);
  }
  const Eigen::Matrix<Scalar, 2, 1> pixel = project_point(lens_, parameters.data(), point);
  for (int i = 0; i < 2; ++i) {
    const Eigen::Matrix<double, kInputs, 1>& derivatives = pixel[i].derivatives();
    if (J_point != nullptr) J_point->row(i) = derivatives.head<3>().transpose();
    if (J_parameters != nullptr) J_parameters->row(i) = derivatives.segment(3, count).transpose();
  }
  return result;
}

Unprojection CameraModel::unproject(const Eigen::Vector2d& pixel) const noexcept {
  const Eigen::Vector2d distorted((pixel.x() - cx_) / fx_, (pixel.y() - cy_) / fy_);
  return is_tangential() ? undistort_tangential(distorted) : undistort_radial(distorted);
}

Unprojection CameraModel::undistort_radial(const Eigen::Vector2d& distorted) const noexcept {
  Unprojection nothing{{kNan, kNan}, beyond()};
  const double target = distorted.norm();
  if (target == 0.0) return {Eigen::Vector2d::Zero(), CameraStatus::kOk};
  const std::array<Dual, 8> k = constants(distortion_);
  if (lens_ == LensModel::kEquidistant) {
    const double max_theta = std::atan(max_radius_);
    if (!(target <= equidistant_angle(distortion_.data(), max_theta))) return nothing;
    const auto angle = [&k](const Dual& theta) { return equidistant_angle(k.data(), theta); };
    const double theta = invert_increasing(angle, target, max_theta);
    return {distorted * (std::tan(theta) / target), CameraStatus::kOk};
  }
  const double r2 = max_radius_ * max_radius_;
  if (!(target <= max_radius_ * radial_factor(lens_, distortion_.data(), r2))) return nothing;
  const auto radius = [&k, this](const Dual& r) {
    const Dual square = r * r;
    return Dual(r * radial_factor(lens_, k.data(), square));
  };
  return {distorted * (invert_increasing(radius, target, max_radius_) / target), CameraStatus::kOk};
}

Unprojection CameraModel::undistort_tangential(const Eigen::Vector2d& distorted) const noexcept {
  // From the point that a lens without tangential terms would give.
  Eigen::Vector2d start = undistort_radial(distorted).xy;
  if (!(start.norm() < max_radius_)) start = 0.9 * max_radius_ * distorted.normalized();
  Solution solution = invert_distortion(lens_, distortion_, distorted, start);
  if (!solution.is_converged) {
    // Near a fold: walk out from the centre, where every lens is tame.
    constexpr int kWalk = 64;
    solution.xy = Eigen::Vector2d::Zero();
    for (int i = 1; i <= kWalk; ++i) {
      const Eigen::Vector2d target = distorted * (static_cast<double>(i) / kWalk);
      solution = invert_distortion(lens_, distortion_, target, solution.xy);
      if (!solution.is_converged) break;
    }
  }
  if (!solution.is_converged || !is_one_to_one_at(solution.xy)) return {{kNan, kNan}, beyond()};
  return {solution.xy, CameraStatus::kOk};
}

bool CameraModel::folds_inside_image() const noexcept {
  const auto has_no_ray = [this](int u, int v) {
    return unproject(Eigen::Vector2d(u, v)).status != CameraStatus::kOk;
  };
  // What lies nearer to the centre than a pixel with a ray has one too: the border tells.
  for (int u = 0; u < width_; ++u) {
    if (has_no_ray(u, 0) || has_no_ray(u, height_ - 1)) return true;
  }
  for (int v = 0; v < height_; ++v) {
    if (has_no_ray(0, v) || has_no_ray(width_ - 1, v)) return true;
  }
  return false;
}

}  // namespace striper
