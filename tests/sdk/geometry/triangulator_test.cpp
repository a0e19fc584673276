// SPDX-License-Identifier: Apache-2.0
// Proves that triangulation is the paper's d = s cot(alpha), reproduces its Table 1, inverts
// projection, and that its derivatives and the calibration sigma are right (against differences and
// sampling).
#include <cmath>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>

#include "support/error_of.hpp"
#include "support/models.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using testing::radians;

TEST(Triangulator, RangeIsBaselineTimesCotangentOfAlpha) {
  const Triangulator triangulator(testing::paper_model(), 0);
  const double f = triangulator.camera().fy();
  for (const double alpha_deg : {3.0, 10.0, 20.0}) {
    const double v = 239.5 + f * std::tan(radians(alpha_deg));
    const PlanePoint point = triangulator.triangulate({319.5, v});
    EXPECT_EQ(point.status, ReturnStatus::kOk);
    EXPECT_NEAR(point.range_m(), 0.5 / std::tan(radians(alpha_deg)), 1e-12);
    EXPECT_NEAR(point.bearing_rad(), 0.0, 1e-12);
  }
}

// The paper's Table 1, s = 50 cm: what one more pixel outward costs at 2 m, 240-line fields whose
// lines are 3/4 of the horizontal pixel angle apart per line: alpha steps by 0.75 HFOV / 240 = 2
// HFOV / 640.
TEST(Triangulator, ReproducesThePapersRangeResolution) {
  struct Row {
    double fov_deg;
    const char* printed_cm;
  };
  for (const Row& row : {Row{30, "1.4"}, Row{55, "2.6"}, Row{105, "5.0"}}) {
    // Equiangular pixels: an equidistant lens without distortion.
    StriperModel model = testing::paper_model();
    const double f = 640.0 / radians(row.fov_deg);
    model.camera = CameraModel(640, 480, f, f, 319.5, 239.5, LensModel::kEquidistant, {0, 0, 0, 0});
    const Triangulator triangulator(model, 0);
    const Eigen::Vector2d pixel = triangulator.project(2.0, 0.0).pixel;
    // One field line is two sensor rows.
    const PlanePoint next = triangulator.triangulate(pixel - Eigen::Vector2d(0.0, 2.0));
    EXPECT_EQ(fmt::format("{:.1f}", 100.0 * (next.range_m() - 2.0)), row.printed_cm);
  }
}

TEST(Triangulator, ReproducesThePapersAngularResolution) {
  for (const auto& [fov_deg, printed] :
       {std::pair{30.0, "0.05"}, std::pair{55.0, "0.09"}, std::pair{105.0, "0.16"}}) {
    StriperModel model = testing::paper_model();
    const double f = 640.0 / radians(fov_deg);
    model.camera = CameraModel(640, 480, f, f, 319.5, 239.5, LensModel::kEquidistant, {0, 0, 0, 0});
    const Triangulator triangulator(model, 0);
    // Far away the plane is in line with the camera and a column is an angle of the lens.
    const Eigen::Vector2d pixel = triangulator.project(1e6, 0.0).pixel;
    const double step = triangulator.triangulate(pixel).bearing_rad() -
                        triangulator.triangulate(pixel + Eigen::Vector2d(1.0, 0.0)).bearing_rad();
    EXPECT_EQ(fmt::format("{:.2f}", step * 180.0 / std::numbers::pi), printed);
  }
}

TEST(Triangulator, ProjectInvertsTriangulate) {
  for (const StriperModel& model :
       {testing::typical_model(), testing::typical_model(StripeAxis::kRows),
        testing::wide_model()}) {
    const Triangulator triangulator(model, 0);
    int checked = 0;
    for (int trial = 0; trial < 300; ++trial) {
      const Eigen::Vector2d pixel(testing::uniform(0, 639), testing::uniform(0, 479));
      const PlanePoint point = triangulator.triangulate(pixel);
      if (point.status != ReturnStatus::kOk) continue;
      ++checked;
      EXPECT_LT((triangulator.project(point.x_m, point.y_m).pixel - pixel).norm(), 1e-8);
    }
    EXPECT_GT(checked, 50);
  }
}

TEST(Triangulator, RayAwayFromThePlaneIsBehindNotZero) {
  const Triangulator triangulator(testing::paper_model(), 0);
  const PlanePoint point = triangulator.triangulate({319.5, 10.0});
  EXPECT_EQ(point.status, ReturnStatus::kBehind);
  EXPECT_TRUE(std::isnan(point.x_m));
}

TEST(Triangulator, LeftInTheImageIsPositiveBearing) {
  const Triangulator triangulator(testing::typical_model(), 0);
  EXPECT_GT(triangulator.triangulate({100.0, 470.0}).bearing_rad(), 0.0);
  EXPECT_LT(triangulator.triangulate({540.0, 470.0}).bearing_rad(), 0.0);
}

TEST(Triangulator, WithRowsUpInTheImageIsPositiveBearing) {
  const Triangulator triangulator(testing::typical_model(StripeAxis::kRows), 0);
  const double above = triangulator.triangulate({200.0, 100.0}).bearing_rad();
  const double below = triangulator.triangulate({200.0, 400.0}).bearing_rad();
  EXPECT_GT(above, below);
}

TEST(Triangulator, MissingLaserIsNamed) {
  EXPECT_STREQ(testing::error_of([] { Triangulator(testing::typical_model(), 1); }).what(),
               "the model has 1 laser and no laser 1; calibrate it");
}

// The point as a function of everything: the oracle for the derivatives.
Eigen::Vector2d point_with(const StriperModel& model, const Eigen::VectorXd& camera_parameters,
                           const Eigen::Vector4d& plane, const Eigen::Vector2d& pixel) {
  StriperModel changed = model;
  changed.camera = model.camera.with_parameters(camera_parameters);
  const Eigen::Vector3d normal = plane.head<3>();
  // A frame that was moved keeps its place relative to the standing one.
  const LaserPlane new_plane(normal.normalized(), plane[3] / normal.norm());
  const Laser& old_laser = model.lasers[0];
  if (old_laser.moved_T_cam_scan) {
    const Eigen::Isometry3d offset =
        standard_T_cam_scan(old_laser.plane, model.axis).inverse() * *old_laser.moved_T_cam_scan;
    changed.lasers[0].moved_T_cam_scan = standard_T_cam_scan(new_plane, model.axis) * offset;
  }
  changed.lasers[0].plane = new_plane;
  const PlanePoint point = Triangulator(changed, 0).triangulate(pixel);
  return {point.x_m, point.y_m};
}

void expect_gradient_is_right(const StriperModel& model, const Eigen::Vector2d& pixel) {
  const TriangulationGradient g = Triangulator(model, 0).gradient(pixel);
  const Eigen::VectorXd parameters = model.camera.parameters();
  Eigen::Vector4d plane;
  plane << model.lasers[0].plane.normal(), model.lasers[0].plane.distance_m();

  for (int j = 0; j < 2; ++j) {
    const Eigen::Vector2d h = 1e-4 * Eigen::Vector2d::Unit(j);
    const Eigen::Vector2d numeric = (point_with(model, parameters, plane, pixel + h) -
                                     point_with(model, parameters, plane, pixel - h)) /
                                    2e-4;
    EXPECT_LT((g.d_pixel.col(j) - numeric).norm(), 1e-5 * (1e-3 + numeric.norm())) << "pixel " << j;
  }
  for (Eigen::Index j = 0; j < parameters.size(); ++j) {
    const double step = 1e-6 * std::max(1.0, std::abs(parameters[j]));
    Eigen::VectorXd h = Eigen::VectorXd::Zero(parameters.size());
    h[j] = step;
    const Eigen::Vector2d numeric = (point_with(model, parameters + h, plane, pixel) -
                                     point_with(model, parameters - h, plane, pixel)) /
                                    (2.0 * step);
    EXPECT_LT((g.d_camera.col(j) - numeric).norm(), 1e-5 * (1e-2 + numeric.norm()))
        << model.camera.parameter_names()[static_cast<std::size_t>(j)];
  }
  // Only directions that keep |n| = 1 mean anything: the covariance has no others.
  const Eigen::Vector3d n = plane.head<3>();
  for (const Eigen::Vector3d& t : {n.unitOrthogonal(), n.cross(n.unitOrthogonal()).eval()}) {
    Eigen::Vector4d h = Eigen::Vector4d::Zero();
    h.head<3>() = 1e-6 * t;
    const Eigen::Vector2d numeric = (point_with(model, parameters, plane + h, pixel) -
                                     point_with(model, parameters, plane - h, pixel)) /
                                    2e-6;
    EXPECT_LT((g.d_plane.leftCols<3>() * t - numeric).norm(), 1e-5 * (1e-2 + numeric.norm()));
  }
  const Eigen::Vector4d h = 1e-6 * Eigen::Vector4d::Unit(3);
  const Eigen::Vector2d numeric = (point_with(model, parameters, plane + h, pixel) -
                                   point_with(model, parameters, plane - h, pixel)) /
                                  2e-6;
  EXPECT_LT((g.d_plane.col(3) - numeric).norm(), 1e-5 * (1e-2 + numeric.norm()));
}

TEST(TriangulationGradient, AgreesWithDifferences) {
  expect_gradient_is_right(testing::typical_model(), {200.0, 430.0});
  expect_gradient_is_right(testing::typical_model(), {600.0, 300.0});
  expect_gradient_is_right(testing::typical_model(StripeAxis::kRows), {250.0, 100.0});
  expect_gradient_is_right(testing::wide_model(), {40.0, 450.0});
}

TEST(TriangulationGradient, AgreesWithDifferencesInAMovedFrame) {
  StriperModel model = testing::typical_model();
  Eigen::Isometry3d offset = Eigen::Isometry3d::Identity();
  offset.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
  offset.translation() << 0.2, -0.3, 0.0;
  model.lasers[0].moved_T_cam_scan =
      standard_T_cam_scan(model.lasers[0].plane, model.axis) * offset;
  expect_gradient_is_right(model, {320.0, 430.0});
}

TEST(Triangulator, CalibrationSigmaIsTheSpreadOfRangesOverSampledCalibrations) {
  StriperModel model = testing::typical_model();
  model.covariance = testing::plausible_covariance(model);
  const Triangulator triangulator(model, 0);
  const Eigen::Vector2d pixel(420.0, 330.0);
  const Eigen::MatrixXd& C = model.covariance->matrix;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(C);
  const Eigen::MatrixXd root =
      ldlt.transpositionsP().transpose() *
      (ldlt.matrixL().toDenseMatrix() *
       ldlt.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal().toDenseMatrix());
  const Eigen::VectorXd parameters = model.camera.parameters();
  Eigen::Vector4d plane;
  plane << model.lasers[0].plane.normal(), model.lasers[0].plane.distance_m();
  const int samples = 4000;
  double sum = 0.0;
  double sum_of_squares = 0.0;
  for (int i = 0; i < samples; ++i) {
    Eigen::VectorXd z(C.rows());
    for (Eigen::Index j = 0; j < z.size(); ++j) z[j] = testing::normal();
    const Eigen::VectorXd change = root * z;
    const double range = point_with(model, parameters + change.head(parameters.size()),
                                    plane + change.tail<4>(), pixel)
                             .norm();
    sum += range;
    sum_of_squares += range * range;
  }
  const double spread = std::sqrt(sum_of_squares / samples - (sum / samples) * (sum / samples));
  // The sampled spread itself is known to 1 / sqrt(2 * 4000) = 1.1 %.
  EXPECT_NEAR(triangulator.sigma_cal_m(pixel) / spread, 1.0, 0.045);
}

TEST(Triangulator, WithoutACovarianceTheCalibrationSigmaIsNan) {
  EXPECT_TRUE(std::isnan(Triangulator(testing::typical_model(), 0).sigma_cal_m({300.0, 400.0})));
}

}  // namespace
}  // namespace striper
