// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>
#include <striper/intrinsics/initial_camera.hpp>

namespace striper {
namespace {

using Points = std::vector<Eigen::Vector2d>;

// Moves points to their centroid and scales them to a mean distance of sqrt(2) (Hartley 1997).
Eigen::Matrix3d normalising(const Points& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  double distance = 0.0;
  for (const auto& p : points) distance += (p - mean).norm();
  const double scale =
      std::sqrt(2.0) * static_cast<double>(points.size()) / std::max(distance, 1e-12);
  Eigen::Matrix3d T;
  T << scale, 0.0, -scale * mean.x(), 0.0, scale, -scale * mean.y(), 0.0, 0.0, 1.0;
  return T;
}

// The homography to = H from by the direct linear transform.
std::optional<Eigen::Matrix3d> homography(const Points& from, const Points& to) {
  if (from.size() < 4) return std::nullopt;
  const Eigen::Matrix3d T_from = normalising(from);
  const Eigen::Matrix3d T_to = normalising(to);
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::Vector3d a = T_from * from[i].homogeneous();
    const Eigen::Vector3d b = T_to * to[i].homogeneous();
    Eigen::Matrix<double, 2, 9> row = Eigen::Matrix<double, 2, 9>::Zero();
    row.block<1, 3>(0, 0) = a.transpose();
    row.block<1, 3>(0, 6) = -b.x() * a.transpose();
    row.block<1, 3>(1, 3) = a.transpose();
    row.block<1, 3>(1, 6) = -b.y() * a.transpose();
    normal += row.transpose() * row;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(normal);
  // Points on a line leave a whole family of homographies.
  if (eigen.eigenvalues()[1] < 1e-9 * eigen.eigenvalues()[8]) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = eigen.eigenvectors().col(0);
  Eigen::Matrix3d H;
  H << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  return Eigen::Matrix3d(T_to.inverse() * H * T_from);
}

Points board_points(const Board& board, const CornerView& view) {
  Points points;
  for (const int index : view.point) points.push_back(board.point_m(index));
  return points;
}

// The pose of H = [r1 r2 t] up to scale, turned into a rotation by the polar decomposition.
Eigen::Isometry3d pose_of(const Eigen::Matrix3d& H) {
  const double scale = 2.0 / (H.col(0).norm() + H.col(1).norm()) * (H(2, 2) < 0.0 ? -1.0 : 1.0);
  Eigen::Matrix3d R;
  R.col(0) = scale * H.col(0);
  R.col(1) = scale * H.col(1);
  R.col(2) = R.col(0).cross(R.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = svd.matrixU() * svd.matrixV().transpose();
  if (T.linear().determinant() < 0.0) {
    Eigen::Matrix3d U = svd.matrixU();
    U.col(2) *= -1.0;
    T.linear() = U * svd.matrixV().transpose();
  }
  T.translation() = scale * H.col(2);
  return T;
}

// Median of the reprojection distances, over all views; infinite where a view has no pose.
double median_error_px(const CameraModel& camera, const Observations& observations) {
  std::vector<double> errors;
  for (const CornerView& view : observations.views) {
    const auto T_cam_board = initial_pose(camera, observations.board, view);
    if (!T_cam_board) continue;
    for (std::size_t i = 0; i < view.pixel.size(); ++i) {
      const Eigen::Vector2d p = observations.board.point_m(view.point[i]);
      const auto projected = camera.project(*T_cam_board * Eigen::Vector3d(p.x(), p.y(), 0.0));
      errors.push_back(
          projected.status == CameraStatus::kOk ? (projected.pixel - view.pixel[i]).norm() : 1e6);
    }
  }
  if (errors.empty()) return std::numeric_limits<double>::infinity();
  return upper_median(errors);
}

CameraModel plain_camera(const Observations& observations, LensModel lens, double fx, double fy) {
  return {observations.image_width,
          observations.image_height,
          fx,
          fy,
          0.5 * (observations.image_width - 1),
          0.5 * (observations.image_height - 1),
          lens,
          std::vector<double>(static_cast<std::size_t>(distortion_count(lens)), 0.0)};
}

// Zhang 2000, eqs. 3-4 with the principal point at the centre: two equations per view, linear in
// 1/fx^2 and 1/fy^2. Empty where the views do not determine them.
std::optional<Eigen::Vector2d> zhang_focal_px(const Observations& observations) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  Eigen::Matrix3d to_centre = Eigen::Matrix3d::Identity();
  to_centre(0, 2) = -0.5 * (observations.image_width - 1);
  to_centre(1, 2) = -0.5 * (observations.image_height - 1);
  for (const CornerView& view : observations.views) {
    const auto found = homography(board_points(observations.board, view), view.pixel);
    if (!found) continue;
    Eigen::Matrix3d H = to_centre * *found;
    H /= H.norm();
    const Eigen::Vector3d a = H.col(0);
    const Eigen::Vector3d b = H.col(1);
    Eigen::Matrix2d A;
    A << a.x() * b.x(), a.y() * b.y(), a.x() * a.x() - b.x() * b.x(), a.y() * a.y() - b.y() * b.y();
    const Eigen::Vector2d c(-a.z() * b.z(), b.z() * b.z() - a.z() * a.z());
    normal += A.transpose() * A;
    right += A.transpose() * c;
  }
  const Eigen::Vector2d inverse_squares = normal.ldlt().solve(right);
  if (!inverse_squares.allFinite() || inverse_squares.minCoeff() <= 0.0) return std::nullopt;
  return Eigen::Vector2d(inverse_squares.cwiseInverse().cwiseSqrt());
}

}  // namespace

std::optional<Eigen::Isometry3d> initial_pose(const CameraModel& camera, const Board& board,
                                              const CornerView& view) {
  Points from;
  Points to;
  for (std::size_t i = 0; i < view.pixel.size(); ++i) {
    const Unprojection ray = camera.unproject(view.pixel[i]);
    if (ray.status != CameraStatus::kOk) continue;
    from.push_back(board.point_m(view.point[i]));
    to.push_back(ray.xy);
  }
  const auto H = homography(from, to);
  if (!H) return std::nullopt;
  return pose_of(*H);
}

CameraModel initial_camera(const Observations& observations, LensModel lens) {
  const double width = observations.image_width;
  std::optional<CameraModel> best;
  double best_error_px = std::numeric_limits<double>::infinity();
  const auto consider = [&](double fx, double fy) {
    const CameraModel camera = plain_camera(observations, lens, fx, fy);
    const double error_px = median_error_px(camera, observations);
    if (error_px >= best_error_px) return;
    best_error_px = error_px;
    best = camera;
  };
  // Focal lengths of a quarter of the image's width to six of it.
  constexpr int kFocals = 29;
  for (int i = 0; i < kFocals; ++i) {
    const double f = 0.25 * width * std::pow(1.12, i);
    consider(f, f);
  }
  if (lens != LensModel::kEquidistant) {
    const auto focal_px = zhang_focal_px(observations);
    if (focal_px && focal_px->minCoeff() > 0.1 * width && focal_px->maxCoeff() < 20.0 * width)
      consider(focal_px->x(), focal_px->y());
  }
  if (!best)
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("no focal length explains the boards of the {} images",
                            observations.views.size()));
  return *best;
}

}  // namespace striper
