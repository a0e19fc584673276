// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include <Eigen/LU>
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>

namespace striper {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const Laser& laser_of(const StriperModel& model, int laser) {
  if (laser < 0 || laser >= static_cast<int>(model.lasers.size())) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("the model has {} laser{} and no laser {}; calibrate it",
                            model.lasers.size(), model.lasers.size() == 1 ? "" : "s", laser));
  }
  return model.lasers[static_cast<std::size_t>(laser)];
}

// The block of the model's covariance that enters a range with this laser, in the order (camera,
// plane).
Eigen::MatrixXd covariance_of(const StriperModel& model, int laser) {
  if (!model.covariance) return {};
  std::vector<std::string> wanted;
  for (const std::string_view name : model.camera.parameter_names()) wanted.emplace_back(name);
  for (const char* name : {"nx", "ny", "nz", "d"})
    wanted.push_back(fmt::format("laser{}_{}", laser, name));

  const std::vector<std::string>& known = model.covariance->parameters;
  const auto count = static_cast<Eigen::Index>(wanted.size());
  std::vector<Eigen::Index> index(wanted.size(), -1);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto found = std::find(known.begin(), known.end(), wanted[i]);
    if (found != known.end()) index[i] = found - known.begin();
  }
  // A parameter that the file does not list was held fixed: it has no variance.
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const Eigen::Index a = index[static_cast<std::size_t>(i)];
      const Eigen::Index b = index[static_cast<std::size_t>(j)];
      if (a >= 0 && b >= 0) covariance(i, j) = model.covariance->matrix(a, b);
    }
  }
  return covariance;
}

// The standing scan frame (origin, x, y) and its derivatives with respect to the plane's normal.
struct StandingFrame {
  Eigen::Vector3d origin, x, y, z;
  Eigen::Matrix3d dx_dn, dy_dn;  // Column j: derivative with respect to n_j.
};

StandingFrame differentiate_standing_frame(const LaserPlane& plane, StripeAxis axis) {
  const Eigen::Isometry3d T = standard_T_cam_scan(plane, axis);
  StandingFrame frame{
      T.translation(), T.linear().col(0), T.linear().col(1), T.linear().col(2), {}, {}};
  const Eigen::Vector3d& n = plane.normal();
  // x = w / |w| with w = e_z - n_z n, the optical axis projected on the plane; z = +-n; y = z cross
  // x.
  const Eigen::Vector3d w = Eigen::Vector3d::UnitZ() - n.z() * n;
  const double z_sign = frame.z.dot(n) > 0.0 ? 1.0 : -1.0;
  const Eigen::Matrix3d project = Eigen::Matrix3d::Identity() - frame.x * frame.x.transpose();
  for (int j = 0; j < 3; ++j) {
    const Eigen::Vector3d e = Eigen::Vector3d::Unit(j);
    const Eigen::Vector3d dw = -(j == 2 ? 1.0 : 0.0) * n - n.z() * e;
    frame.dx_dn.col(j) = project * dw / w.norm();
    frame.dy_dn.col(j) = z_sign * e.cross(frame.x) + frame.z.cross(frame.dx_dn.col(j));
  }
  return frame;
}

}  // namespace

Triangulator::Triangulator(const StriperModel& model, int laser)
    : camera_(model.camera),
      plane_(laser_of(model, laser).plane),
      axis_(model.axis),
      T_cam_scan_(model.T_cam_scan(laser)),
      T_standing_scan_(standard_T_cam_scan(plane_, axis_).inverse() * T_cam_scan_),
      homography_(laser_homography(plane_, T_cam_scan_)),
      covariance_(covariance_of(model, laser)) {
  if (!(plane_.distance_m() > 0.0)) {
    throw Error(
        ErrorKind::kBadValue,
        fmt::format("laser {}: the plane passes through the camera centre (distance_m is {}): "
                    "every point would be seen at every range",
                    laser, plane_.distance_m()));
  }
}

PlanePoint Triangulator::triangulate(const Eigen::Vector2d& pixel) const noexcept {
  const Unprojection ray = camera_.unproject(pixel);
  if (ray.status != CameraStatus::kOk) return {kNan, kNan, ReturnStatus::kOutsideModel};
  return triangulate_ray(ray.xy);
}

PlanePoint Triangulator::triangulate_ray(const Eigen::Vector2d& xy) const noexcept {
  const Eigen::Vector3d p = homography_ * xy.homogeneous();
  if (!(p.z() > 0.0)) return {kNan, kNan, ReturnStatus::kBehind};
  return {p.x() / p.z(), p.y() / p.z(), ReturnStatus::kOk};
}

Projection Triangulator::project(double x_m, double y_m) const noexcept {
  return camera_.project(T_cam_scan_ * Eigen::Vector3d(x_m, y_m, 0.0));
}

TriangulationGradient Triangulator::gradient(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector3d ray = camera_.unproject(pixel).xy.homogeneous();
  const Eigen::Vector3d& n = plane_.normal();
  const double n_ray = n.dot(ray);
  const double depth = plane_.distance_m() / n_ray;
  const Eigen::Vector3d p = depth * ray;

  // How the ray follows the pixel and the camera's parameters: from pixel = projection(ray,
  // parameters).
  Eigen::Matrix<double, 2, 3> J_point;
  Eigen::Matrix<double, 2, Eigen::Dynamic> J_parameters;
  camera_.project(ray, &J_point, &J_parameters);
  const Eigen::Matrix2d dxy_dpixel = J_point.leftCols<2>().inverse();

  // How the point follows the ray and the plane: p = d ray / (n . ray).
  Eigen::Matrix<double, 3, 2> dp_dxy;
  for (int j = 0; j < 2; ++j) {
    dp_dxy.col(j) = depth * (Eigen::Vector3d::Unit(j) - ray * (n[j] / n_ray));
  }
  const Eigen::Matrix3d dp_dn = -(depth / n_ray) * ray * ray.transpose();
  const Eigen::Vector3d dp_dd = ray / n_ray;

  const StandingFrame frame = differentiate_standing_frame(plane_, axis_);
  const Eigen::Vector3d from_origin = p - frame.origin;
  Eigen::Matrix<double, 2, 3> axes;
  axes.row(0) = frame.x.transpose();
  axes.row(1) = frame.y.transpose();

  TriangulationGradient g;
  g.d_pixel = axes * dp_dxy * dxy_dpixel;
  g.d_camera = -g.d_pixel * J_parameters;
  const Eigen::Matrix3d dorigin_dn = plane_.distance_m() * Eigen::Matrix3d::Identity();
  g.d_plane.leftCols<3>() = axes * (dp_dn - dorigin_dn);
  g.d_plane.row(0).head<3>() += from_origin.transpose() * frame.dx_dn;
  g.d_plane.row(1).head<3>() += from_origin.transpose() * frame.dy_dn;
  g.d_plane.col(3) = axes * (dp_dd - n);

  // A frame that the file moved keeps its place relative to the standing one.
  const Eigen::Matrix2d to_moved = T_standing_scan_.linear().topLeftCorner<2, 2>().transpose();
  g.d_pixel = to_moved * g.d_pixel;
  g.d_camera = to_moved * g.d_camera;
  g.d_plane = to_moved * g.d_plane;
  return g;
}

double Triangulator::sigma_cal_m(const Eigen::Vector2d& pixel) const {
  const PlanePoint point = triangulate(pixel);
  if (!has_covariance() || point.status != ReturnStatus::kOk) return kNan;
  const TriangulationGradient g = gradient(pixel);
  Eigen::Matrix<double, 2, Eigen::Dynamic> d_all(2, covariance_.cols());
  d_all << g.d_camera, g.d_plane;
  const Eigen::Vector2d direction = Eigen::Vector2d(point.x_m, point.y_m).normalized();
  const Eigen::VectorXd g_range = d_all.transpose() * direction;
  return std::sqrt(std::max(0.0, g_range.dot(covariance_ * g_range)));
}

}  // namespace striper
