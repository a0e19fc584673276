// SPDX-License-Identifier: Apache-2.0
#include "model/model_checks.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/yaml_document.hpp"
#include "model/scan_frame.hpp"
#include "model/stripe_block.hpp"

namespace striper::detail {
namespace {

constexpr double kTolerance = 1e-6;
// Of correlations, which are at most 1: what the rounding of a printed matrix may cost.
constexpr double kCorrelationTolerance = 1e-6;
constexpr const char* kDataField = "covariance.data";

std::optional<Violation> check_moved_frame(const LaserPlane& plane, const Eigen::Isometry3d& T,
                                           const std::string& field) {
  const Eigen::Matrix3d R = T.linear();
  if (!T.matrix().allFinite()) return Violation{field, "not finite", "finite numbers"};
  const double skew = (R.transpose() * R - Eigen::Matrix3d::Identity()).norm();
  if (skew <= kTolerance && R.determinant() < 0.0) {
    return Violation{field, "a left-handed frame", "a right-handed one"};
  }
  if (skew > kTolerance) {
    return Violation{field, fmt::format("off a rotation by {:.3g}", skew),
                     fmt::format("a right-handed rotation to {}", kTolerance)};
  }
  const double tilt = plane.normal().cross(R.col(2)).norm();
  if (tilt > kTolerance) {
    return Violation{
        field, fmt::format("its z axis is {:.3g} rad off the laser plane's normal", tilt),
        fmt::format("at most {}: the x-y plane of the frame is the laser plane", kTolerance)};
  }
  const double off = std::abs(plane.signed_distance_m(T.translation()));
  if (off > kTolerance * std::max(1.0, T.translation().norm())) {
    return Violation{
        field, fmt::format("its origin is {:.3g} m off the laser plane", off),
        fmt::format("at most {}: the x-y plane of the frame is the laser plane", kTolerance)};
  }
  return std::nullopt;
}

std::optional<Violation> check_homography(const Eigen::Matrix3d& given,
                                          const Eigen::Matrix3d& expected,
                                          const std::string& field) {
  const double norm = given.stableNorm();
  if (!std::isfinite(norm) || norm == 0.0) {
    return Violation{field, norm == 0.0 ? "all zero" : "not finite", "a non-zero matrix"};
  }
  const Eigen::Matrix3d H = given / norm;
  const double off = std::min((H - expected).norm(), (H + expected).norm());
  if (off <= kTolerance) return std::nullopt;
  return Violation{field, fmt::format("off by {:.3g} from the one of the plane", off),
                   fmt::format("the homography of normal, distance_m and scan frame, up to scale "
                               "to {}; leave it out and it is computed",
                               kTolerance)};
}

std::optional<Violation> check_laser(const StriperModel& model, std::size_t index) {
  const Laser& laser = model.lasers[index];
  const std::string field = fmt::format("lasers[{}]", index);
  if (!(laser.plane.distance_m() > 0.0)) {
    return Violation{field + ".distance_m", fmt::format("{}", laser.plane.distance_m()),
                     "more than 0: from a plane through the camera's centre follows no range"};
  }
  if (laser.moved_T_cam_scan) {
    auto bad = check_moved_frame(laser.plane, *laser.moved_T_cam_scan, field + ".T_cam_scan");
    if (bad) return bad;
  }
  if (!laser.moved_T_cam_scan) {
    if (const auto obstacle = find_obstacle(laser.plane, model.axis)) {
      return Violation{field + ".normal", obstacle->value, obstacle->expected};
    }
  }
  if (!laser.homography) return std::nullopt;
  const Eigen::Isometry3d T_cam_scan = model.T_cam_scan(static_cast<int>(index));
  return check_homography(*laser.homography, laser_homography(laser.plane, T_cam_scan),
                          field + ".homography");
}

std::optional<Violation> check_noise(const NoiseModel& noise) {
  const auto check = [](std::string_view field, double value) -> std::optional<Violation> {
    if (std::isfinite(value) && value >= 0.0) return std::nullopt;
    return Violation{fmt::format("noise.{}", field), fmt::format("{}", value),
                     "a finite number, 0 or more"};
  };
  if (auto bad = check("read_noise_dn", noise.read_noise_dn)) return bad;
  if (auto bad = check("dn_per_electron", noise.dn_per_electron)) return bad;
  if (auto bad = check("black_level_dn", noise.black_level_dn)) return bad;
  if (!noise.bit_depth || (*noise.bit_depth >= 8 && *noise.bit_depth <= 16)) return std::nullopt;
  return Violation{"noise.bit_depth", fmt::format("{}", *noise.bit_depth),
                   "a whole number from 8 to 16"};
}

std::optional<Violation> check_names(const StriperModel& model) {
  const std::vector<std::string> known = known_parameters(model);
  std::set<std::string> seen;
  const std::vector<std::string>& names = model.covariance->parameters;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string field = fmt::format("covariance.parameters[{}]", i);
    if (std::find(known.begin(), known.end(), names[i]) == known.end()) {
      return Violation{field, in_quotes(names[i]),
                       fmt::format("one of {}", fmt::join(known, ", "))};
    }
    if (!seen.insert(names[i]).second) {
      return Violation{field, in_quotes(names[i]), "each parameter once"};
    }
  }
  return std::nullopt;
}

// Checks the elements by pairs, each against the variances that it belongs to.
std::optional<Violation> check_elements(const ModelCovariance& covariance) {
  const Eigen::MatrixXd& C = covariance.matrix;
  const auto name = [&](Eigen::Index i) {
    return covariance.parameters[static_cast<std::size_t>(i)];
  };
  for (Eigen::Index i = 0; i < C.rows(); ++i) {
    if (!std::isfinite(C(i, i)) || C(i, i) < 0.0) {
      return Violation{kDataField, fmt::format("variance of {} is {}", name(i), C(i, i)),
                       "a finite number, 0 or more"};
    }
    for (Eigen::Index j = 0; j < i; ++j) {
      const double scale = std::sqrt(C(i, i)) * std::sqrt(C(j, j));
      if (!(std::abs(C(i, j) - C(j, i)) <= scale * kCorrelationTolerance)) {
        return Violation{
            kDataField,
            fmt::format("covariance of {} and {} is {} above the diagonal and {} below", name(j),
                        name(i), C(j, i), C(i, j)),
            "a symmetric matrix"};
      }
      if (!(std::abs(C(i, j)) <= scale * (1.0 + kCorrelationTolerance))) {
        return Violation{kDataField,
                         fmt::format("covariance of {} and {} is {}", name(j), name(i), C(i, j)),
                         fmt::format("at most {}, the geometric mean of their variances", scale)};
      }
    }
  }
  return std::nullopt;
}

std::optional<Violation> check_matrix(const ModelCovariance& covariance) {
  const Eigen::MatrixXd& C = covariance.matrix;
  const auto size = static_cast<Eigen::Index>(covariance.parameters.size());
  if (C.rows() != size || C.cols() != size) {
    return Violation{kDataField, fmt::format("{} x {}", C.rows(), C.cols()),
                     fmt::format("{} x {}, as parameters has names", size, size)};
  }
  if (auto bad = check_elements(covariance)) return bad;
  if (size == 0) return std::nullopt;
  // Of correlations, so that pixels, metres and coefficients are judged alike.
  const Eigen::VectorXd sigma = C.diagonal().cwiseSqrt();
  const Eigen::VectorXd scale = (sigma.array() > 0.0).select(sigma.cwiseInverse(), 0.0);
  const Eigen::MatrixXd correlation = scale.asDiagonal() * C * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(correlation, Eigen::EigenvaluesOnly);
  const double smallest = solver.eigenvalues()[0];
  if (smallest >= -kCorrelationTolerance * static_cast<double>(size)) return std::nullopt;
  return Violation{kDataField,
                   fmt::format("smallest eigenvalue of the correlations {:.3g}", smallest),
                   "0 or more: a covariance is positive semi-definite"};
}

}  // namespace

std::vector<std::string> known_parameters(const StriperModel& model) {
  const std::vector<std::string_view> camera = model.camera.parameter_names();
  std::vector<std::string> names(camera.begin(), camera.end());
  for (std::size_t i = 0; i < model.lasers.size(); ++i) {
    for (const char* part : {"nx", "ny", "nz", "d"})
      names.push_back(fmt::format("laser{}_{}", i, part));
  }
  return names;
}

std::optional<Violation> find_violation(const StriperModel& model) {
  for (std::size_t i = 0; i < model.lasers.size(); ++i) {
    if (auto bad = check_laser(model, i)) return bad;
    if (auto bad = check_look(model.lasers[i].look, i)) return bad;
  }
  if (model.noise) {
    if (auto bad = check_noise(*model.noise)) return bad;
  }
  if (model.covariance) {
    if (auto bad = check_names(model)) return bad;
    if (auto bad = check_matrix(*model.covariance)) return bad;
  }
  return std::nullopt;
}

}  // namespace striper::detail
