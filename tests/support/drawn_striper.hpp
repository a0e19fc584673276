// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include <striper/geometry/triangulator.hpp>
#include <striper/scan/polar_scan.hpp>

#include "support/models.hpp"
#include "support/random.hpp"

namespace striper::testing {

/// A straight surface of the scan plane from a to b.
struct Wall {
  Eigen::Vector2d a, b;
};

/// The range at which a ray from the origin meets the nearest wall; NaN where none.
inline double range_of_walls(double bearing_rad, const std::vector<Wall>& walls) {
  const Eigen::Vector2d v(std::cos(bearing_rad), std::sin(bearing_rad));
  double nearest = std::numeric_limits<double>::quiet_NaN();
  for (const Wall& wall : walls) {
    const Eigen::Vector2d along = wall.b - wall.a;
    const double cross = v.x() * along.y() - v.y() * along.x();
    const double range = (wall.a.x() * along.y() - wall.a.y() * along.x()) / cross;
    const double part = (wall.a.x() * v.y() - wall.a.y() * v.x()) / cross;
    if (range > 0.0 && part >= 0.0 && part <= 1.0 && !(range >= nearest)) nearest = range;
  }
  return nearest;
}

/// A model that is wrong by one draw from its own covariance.
inline StriperModel drawn_model(const StriperModel& model) {
  const Eigen::MatrixXd& covariance = model.covariance->matrix;
  const Eigen::LDLT<Eigen::MatrixXd> root(covariance);
  Eigen::VectorXd z(covariance.rows());
  for (Eigen::Index i = 0; i < z.size(); ++i)
    z[i] = normal(0.0, std::sqrt(std::max(root.vectorD()[i], 0.0)));
  const Eigen::VectorXd by =
      root.transpositionsP().transpose() * Eigen::VectorXd(root.matrixL() * z);
  StriperModel drawn = model;
  Eigen::VectorXd camera = model.camera.parameters();
  camera += by.head(camera.size());
  drawn.camera = CameraModel(model.camera.width(), model.camera.height(), camera[0], camera[1],
                             camera[2], camera[3], model.camera.lens(),
                             std::vector<double>(camera.data() + 4, camera.data() + camera.size()));
  const LaserPlane& plane = model.lasers[0].plane;
  const Eigen::Vector4d of_plane = by.tail<4>();
  drawn.lasers[0].plane = LaserPlane((plane.normal() + of_plane.head<3>()).normalized(),
                                     plane.distance_m() + of_plane[3]);
  return drawn;
}

/// Scans of exact geometry by a striper that is not quite the one its model says.
class DrawnStriper {
 public:
  /// @param truth  what it is; `model` what is believed.
  DrawnStriper(const StriperModel& model, const StriperModel& truth, double row_sigma_px)
      : model_(model, 0), truth_(truth, 0), row_sigma_px_(row_sigma_px) {}

  /// @param shape  the exact range at a bearing of the true scan frame; NaN where nothing is.
  void scan(const std::function<double(double)>& shape, PolarScan& scan) const {
    scan.returns.assign(static_cast<std::size_t>(truth_.camera().width()), {});
    for (std::size_t u = 0; u < scan.returns.size(); ++u) {
      scan.returns[u].u_px = static_cast<double>(u);
      const double v = row_of(shape, static_cast<double>(u));
      if (std::isfinite(v)) put(v + normal(0.0, row_sigma_px_), scan.returns[u]);
    }
  }

 private:
  // The row at which a column sees the shape: Newton's steps on the bearing.
  double row_of(const std::function<double(double)>& shape, double u) const {
    double bearing = truth_.triangulate({u, 300.0}).bearing_rad();
    for (int step = 0; step < 40; ++step) {  // Slow where the surface is seen at a grazing angle.
      const double range = shape(bearing);
      const Eigen::Vector2d at =
          truth_.project(range * std::cos(bearing), range * std::sin(bearing)).pixel;
      if (!at.allFinite()) break;
      if (std::abs(at.x() - u) < 1e-7) return at.y() < truth_.camera().height() ? at.y() : NAN;
      const double next = bearing + 1e-6;
      const double beside =
          truth_.project(range * std::cos(next), range * std::sin(next)).pixel.x();
      bearing += (u - at.x()) * 1e-6 / (beside - at.x());
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  void put(double v, Return& r) const {
    const PlanePoint point = model_.triangulate({r.u_px, v});
    const PlanePoint next = model_.triangulate({r.u_px, v + 1e-3});
    if (point.status != ReturnStatus::kOk || next.status != ReturnStatus::kOk) return;
    r.v_px = v;
    r.x_m = point.x_m;
    r.y_m = point.y_m;
    r.range_m = point.range_m();
    r.bearing_rad = point.bearing_rad();
    r.sigma_m = std::abs(next.range_m() - r.range_m) * 1e3 * row_sigma_px_;
    r.status = ReturnStatus::kOk;
  }

  Triangulator model_, truth_;
  double row_sigma_px_;
};

}  // namespace striper::testing
