// SPDX-License-Identifier: Apache-2.0
// Proves the truth against geometry worked out by hand: every lens, both axes, shadows, occlusion,
// fan, several returns in a scan line, motion, cylinders; and that the rendered stripe is where the
// truth says on tilted walls too. Does not prove the stripe's shape at depth edges.
#include <cmath>
#include <set>
#include <string_view>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/simulator/simulator.hpp>
#include <striper/simulator/truth.hpp>

#include "capture/simulator/lit_scene.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using Eigen::Vector3d;
using testing::object;

/// What an independent chain says of a return: scan frame -> camera -> lens.
void expect_consistent(const Simulator& simulator, int laser, const TrueReturn& there) {
  const StriperModel model = simulator.model();
  const Eigen::Isometry3d T_cam_scan = model.T_cam_scan(laser);
  const Vector3d p_cam = T_cam_scan * Vector3d(there.x_m, there.y_m, 0.0);
  const Projection seen = model.camera.project(p_cam);
  ASSERT_EQ(seen.status, CameraStatus::kOk);
  EXPECT_NEAR(seen.pixel.x(), there.u_px, 2e-9);
  EXPECT_NEAR(seen.pixel.y(), there.v_px, 2e-9);
  EXPECT_NEAR(there.range_m, std::hypot(there.x_m, there.y_m), 1e-12);
  EXPECT_NEAR(there.bearing_rad, std::atan2(there.y_m, there.x_m), 1e-12);
}

TEST(Truth, TiltedWallThroughEveryLensOnBothAxes) {
  const CameraModel pinhole = Scene::pinhole(640, 480, 70.0);
  const double f = pinhole.fx();
  const std::vector<CameraModel> lenses = {
      CameraModel(640, 480, f, 1.01 * f, 310.0, 244.0, LensModel::kPlumbBob,
                  {-0.25, 0.08, 1e-3, -5e-4, -0.01}),
      CameraModel(640, 480, f, f, 322.0, 238.0, LensModel::kRationalPolynomial,
                  {0.4, 0.05, 2e-4, 3e-4, 0.01, 0.7, 0.1, 0.01}),
      CameraModel(640, 480, 349.0, 348.0, 318.0, 241.0, LensModel::kEquidistant,
                  {-0.02, 0.004, -1e-3, 1e-4})};
  for (const CameraModel& lens : lenses) {
    for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
      Scene scene = Scene::flat_wall(2.0);
      scene.camera = lens;
      scene.axis = axis;
      scene.camera_rotation = rotation_from_rpy(0.02, 0.1, -0.03);
      scene.lasers[0].fan_rad = 2.5;
      if (axis == StripeAxis::kRows) {
        scene.lasers[0].T_device_laser = Eigen::Translation3d(0.0, 0.4, 0.1) *
                                         Eigen::Isometry3d(rotation_from_rpy(1.6, 0.0, -0.1));
      }
      const Vector3d normal(-1.0, 0.3, 0.2);
      scene.objects[0].T_world_object.linear() = facing(normal);
      Simulator simulator(scene);
      const Truth truth = simulator.truth(0).at(0);
      const Eigen::Isometry3d T_cam_scan = simulator.model().T_cam_scan(0);
      int visible = 0;
      for (const TrueLine& line : truth.lines) {
        if (line.status != TruthStatus::kVisible) continue;
        ++visible;
        expect_consistent(simulator, 0, line.brightest);
        const Vector3d p_world =
            scene.T_device_cam() *
            (T_cam_scan * Vector3d(line.brightest.x_m, line.brightest.y_m, 0.0));
        EXPECT_NEAR(normal.normalized().dot(p_world - Vector3d(2.0, 0.0, 0.0)), 0.0, 1e-9);
      }
      EXPECT_GT(visible, axis == StripeAxis::kColumns ? 500 : 400);
    }
  }
}

TEST(Truth, CylinderIsRound) {
  Scene scene;
  scene.objects.push_back(object(Cylinder{0.3, 2.0}, {2.0, 0.1, 0.0}));
  Simulator simulator(scene);
  int visible = 0;
  const Truth truth = simulator.truth(0).at(0);
  for (const TrueLine& line : truth.lines) {
    if (line.status != TruthStatus::kVisible) continue;
    ++visible;
    expect_consistent(simulator, 0, line.brightest);
    EXPECT_NEAR(std::hypot(line.brightest.x_m - 2.0, line.brightest.y_m - 0.1), 0.3, 1e-9);
    EXPECT_LT(line.brightest.x_m, 2.0);
  }
  // As wide as the tangents from the camera: asin(r / d) to either side of its middle.
  const double half_angle = std::asin(0.3 / std::hypot(2.0, 0.1));
  const double middle = std::atan2(0.1, 2.0);
  const double columns =
      scene.camera.fx() * (std::tan(middle + half_angle) - std::tan(middle - half_angle));
  EXPECT_NEAR(visible, columns, 1.0);
}

TEST(Truth, PlateInFrontOfAWallHidesItInItsOwnColumnsOnly) {
  Scene scene = Scene::flat_wall(3.0);
  scene.objects.push_back(object(Rectangle{0.3, 2.0}, {1.5, 0.0, 0.0}));
  const Truth truth = Simulator(scene).truth(0).at(0);
  // Seen from above, camera and laser are one point: there is no shadow.
  for (const TrueLine& line : truth.lines) {
    ASSERT_EQ(line.status, TruthStatus::kVisible);
    const double y_over_x = (319.5 - line.brightest.u_px) / scene.camera.fx();
    const bool on_plate = std::abs(y_over_x) < 0.15 / 1.5;
    EXPECT_NEAR(line.brightest.x_m, on_plate ? 1.5 : 3.0, 1e-9);
    EXPECT_EQ(line.brightest.object, on_plate ? 1 : 0);
    const double to_edge_px = std::abs(std::abs(y_over_x) - 0.1) * scene.camera.fx();
    if (to_edge_px > 3.9 && to_edge_px < 4.6) continue;
    EXPECT_EQ(line.brightest.near_edge, to_edge_px < 4.2) << line.brightest.u_px;
  }
}

TEST(Truth, LaserBesideTheCameraCastsAShadowThatTheCameraSees) {
  Scene scene = Scene::flat_wall(3.0);
  scene.objects.push_back(object(Rectangle{0.3, 2.0}, {1.5, 0.0, 0.0}));
  scene.lasers[0].T_device_laser.translation() = Vector3d(0.0, 0.4, -0.5);
  scene.lasers[0].fan_rad = 2.0;
  Simulator simulator(scene);
  const Truth truth = simulator.truth(0).at(0);
  const cv::Mat image = simulator.expected_dn(0);
  int shadowed = 0;
  for (std::size_t column = 0; column < truth.lines.size(); ++column) {
    const double y_on_wall = 3.0 * (319.5 - static_cast<double>(column)) / scene.camera.fx();
    const bool hidden = std::abs(y_on_wall) < 0.3;
    // From the laser at y = 0.4 the plate's edges at +-0.15 fall on the wall at -0.1 and -0.7.
    const bool dark = y_on_wall > -0.7 && y_on_wall < -0.1 && !hidden;
    const TruthStatus status = truth.lines[column].status;
    EXPECT_EQ(status, dark ? TruthStatus::kShadowed : TruthStatus::kVisible) << column;
    shadowed += dark ? 1 : 0;
    const double from_edges =
        std::min(std::abs(y_on_wall + 0.7), std::abs(y_on_wall + 0.3)) * scene.camera.fx() / 3.0;
    if (!dark || from_edges < 1.0) continue;
    double brightest = 0.0;
    cv::minMaxLoc(image.col(static_cast<int>(column)), nullptr, &brightest);
    EXPECT_EQ(brightest, scene.imager.black_level_dn);
  }
  EXPECT_NEAR(shadowed, 0.4 * scene.camera.fx() / 3.0, 1.0);
}

TEST(Truth, PlateThatTheSheetPassesBelowHidesTheStripe) {
  Scene scene = Scene::flat_wall(3.0);
  // Between the camera and the wall's stripe, its lower edge above the laser plane.
  scene.objects.push_back(object(Rectangle{0.3, 0.4}, {1.5, 0.0, -0.25}));
  const Truth truth = Simulator(scene).truth(0).at(0);
  EXPECT_EQ(truth.lines[320].status, TruthStatus::kNoSurface);
  EXPECT_TRUE(std::isnan(truth.lines[320].brightest.v_px));
  EXPECT_TRUE(std::isnan(truth.lines[320].brightest.range_m));
  EXPECT_EQ(truth.lines[320].brightest.u_px, 320.0);
  EXPECT_EQ(truth.lines[100].status, TruthStatus::kVisible);
}

TEST(Truth, BeyondTheFanThereIsNoLight) {
  Scene scene = Scene::flat_wall(2.0);
  scene.lasers[0].fan_rad = 0.5;
  Simulator simulator(scene);
  const Truth truth = simulator.truth(0).at(0);
  const cv::Mat image = simulator.expected_dn(0);
  for (const TrueLine& line : truth.lines) {
    const double bearing = std::atan((319.5 - line.brightest.u_px) / scene.camera.fx());
    EXPECT_EQ(line.status,
              std::abs(bearing) < 0.25 ? TruthStatus::kVisible : TruthStatus::kOutsideFan);
    EXPECT_NEAR(line.brightest.x_m, 2.0, 1e-9);  // The surface is known all the same.
    EXPECT_EQ(std::isnan(line.brightest.amplitude_dn), line.status != TruthStatus::kVisible);
  }
  EXPECT_EQ(cv::countNonZero(image.col(10) != scene.imager.black_level_dn), 0);
}

TEST(Truth, TwoReturnsInAColumnAreBothListedTheBrightestFirst) {
  Scene scene = Scene::flat_wall(3.0);
  // Low plate: the camera sees the wall's stripe over it; the laser reaches that from the side.
  scene.objects.push_back(object(Rectangle{0.3, 0.25}, {1.5, 0.0, -0.575}));
  scene.lasers[0].T_device_laser.translation() = Vector3d(0.0, 1.0, -0.5);
  scene.lasers[0].fan_rad = 2.0;
  Simulator simulator(scene);
  const TrueLine line = simulator.truth(0).at(0).lines[320];
  ASSERT_EQ(line.status, TruthStatus::kVisible);
  ASSERT_EQ(line.others.size(), 1U);
  EXPECT_NEAR(line.brightest.x_m, 1.5, 1e-9);
  EXPECT_NEAR(line.others[0].x_m, 3.0, 1e-9);
  EXPECT_GT(line.brightest.amplitude_dn, line.others[0].amplitude_dn);
  expect_consistent(simulator, 0, line.others[0]);
  // A dark plate makes the wall the brightest.
  scene.objects[1].material.reflectance = 0.01;
  EXPECT_NEAR(Simulator(scene).truth(0).at(0).lines[320].brightest.x_m, 3.0, 1e-9);
}

TEST(Truth, WallThatComesNearerAndDeviceThatGoesThereAreTheSame) {
  Scene approaching = Scene::flat_wall(3.0);
  approaching.objects[0].motion.velocity_m_s = {-1.0, 0.0, 0.0};
  Scene driving = Scene::flat_wall(3.0);
  driving.device_motion.velocity_m_s = {1.0, 0.0, 0.0};
  Simulator a(approaching);
  Simulator b(driving);
  for (const std::uint64_t sequence : {0U, 30U, 45U}) {
    const double expected = 3.0 - static_cast<double>(sequence) / 30.0;
    const TrueReturn there = a.truth(sequence).at(0).lines[200].brightest;
    EXPECT_NEAR(there.x_m, expected, 1e-9);
    EXPECT_NEAR(b.truth(sequence).at(0).lines[200].brightest.v_px, there.v_px, 1e-9);
    EXPECT_LT(cv::norm(a.expected_dn(sequence), b.expected_dn(sequence), cv::NORM_INF), 1e-3);
  }
}

TEST(Truth, WallTurnsAboutItsOwnOrigin) {
  Scene scene = Scene::flat_wall(2.0);
  scene.objects[0].motion.angular_velocity_rad_s = {0.0, 0.0, 0.6};
  Simulator simulator(scene);
  const double angle = 0.6 * 15.0 / 30.0;
  const Truth truth = simulator.truth(15).at(0);
  for (const TrueLine& line : truth.lines) {
    if (line.status != TruthStatus::kVisible) continue;
    const double off =
        std::cos(angle) * (line.brightest.x_m - 2.0) + std::sin(angle) * line.brightest.y_m;
    EXPECT_NEAR(off, 0.0, 1e-9);
  }
}

TEST(Truth, SceneWithoutSurfacesIsEmptyAndDark) {
  Simulator simulator{Scene()};
  const Truth truth = simulator.truth(0).at(0);
  for (const TrueLine& line : truth.lines) EXPECT_EQ(line.status, TruthStatus::kNoSurface);
  EXPECT_EQ(cv::countNonZero(simulator.expected_dn(0) != 8.0), 0);
}

TEST(Truth, LaserThatShinesFromBehindAPlateDoesNotShow) {
  Scene scene = Scene::flat_wall(2.0);
  scene.lasers[0].T_device_laser =
      Eigen::Translation3d(4.0, 0.0, -0.5) * Eigen::Isometry3d(rotation_from_rpy(0.0, 0.0, M_PI));
  Simulator simulator(scene);
  EXPECT_EQ(simulator.truth(0).at(0).lines[320].status, TruthStatus::kShadowed);
  EXPECT_EQ(cv::countNonZero(simulator.expected_dn(0) != 8.0), 0);
}

TEST(Truth, ColumnsThatTheLensCannotSeeAreOutsideTheModel) {
  Scene scene = Scene::flat_wall(2.0);
  // A fisheye whose image of 180 degrees is narrower than the sensor.
  scene.camera = CameraModel(640, 480, 180.0, 180.0, 319.5, 239.5, LensModel::kEquidistant,
                             {0.0, 0.0, 0.0, 0.0});
  const Truth truth = Simulator(scene).truth(0).at(0);
  EXPECT_EQ(truth.lines.front().status, TruthStatus::kOutsideModel);
  EXPECT_EQ(truth.lines[320].status, TruthStatus::kVisible);
}

TEST(Truth, LightSourceOverTheStripeMakesItBlind) {
  Scene scene = Scene::flat_wall(2.0);
  SceneObject light_source = object(Disc{0.05}, {1.99, 0.2, -0.5});
  light_source.material.radiance_w_m2_sr_nm = 50.0;
  scene.objects.push_back(light_source);
  const Truth truth = Simulator(scene).truth(0).at(0);
  const double u_light_source = 319.5 - scene.camera.fx() * 0.2 / 1.99;
  const TrueLine& covered = truth.lines[static_cast<std::size_t>(std::lround(u_light_source))];
  EXPECT_TRUE(covered.brightest.blind);
  EXPECT_TRUE(covered.brightest.clipped);
  EXPECT_FALSE(truth.lines[400].brightest.blind);
}

/// First moment of the stripe's light in a column.
double centroid(const cv::Mat& image, int column, double black) {
  double sum = 0.0;
  double moment = 0.0;
  for (int row = 0; row < image.rows; ++row) {
    const double light = image.at<float>(row, column) - black;
    sum += light;
    moment += row * light;
  }
  return moment / sum;
}

TEST(Truth, RenderedStripeOnTiltedWallsIsWhereTheTruthSays) {
  for (int trial = 0; trial < 6; ++trial) {
    Scene scene = Scene::flat_wall(2.0);
    scene.imager.blur_sigma_px = 0.5;
    scene.lasers[0].divergence_sigma_rad *= 0.5;
    scene.lasers[0].T_device_laser.linear() =
        rotation_from_rpy(testing::uniform(-0.2, 0.2), 0.0, 0.0);
    scene.objects[0].T_world_object.linear() =
        facing({-1.0, testing::uniform(-0.6, 0.6), testing::uniform(-0.3, 0.3)});
    Simulator simulator(scene);
    const cv::Mat image = simulator.expected_dn(0);
    const Truth truth = simulator.truth(0).at(0);
    for (int column = 10; column < 630; ++column) {
      const TrueLine& line = truth.lines[static_cast<std::size_t>(column)];
      if (line.status != TruthStatus::kVisible || line.brightest.near_edge) continue;
      if (line.brightest.v_px > 470.0) continue;  // Part of it is outside the image.
      // The profile is skewed by the wall's tilt, in the second order of its width.
      EXPECT_NEAR(centroid(image, column, 8.0), line.brightest.v_px, 0.02);
    }
  }
}

TEST(Truth, ObjectPosesAreThoseOfTheScene) {
  Scene scene = Scene::flat_wall(2.0);
  scene.objects[0].motion.velocity_m_s = {0.0, 0.3, 0.0};
  const Simulator simulator(scene);
  const Eigen::Isometry3d T_cam_wall = simulator.T_cam_object(0, 30);
  EXPECT_TRUE(T_cam_wall.translation().isApprox(Vector3d(-0.3, 0.0, 2.0), 1e-12));
}

TEST(Truth, EveryStatusHasAWordOfItsOwn) {
  std::set<std::string_view> words;
  for (const auto status : {TruthStatus::kVisible, TruthStatus::kNoSurface, TruthStatus::kShadowed,
                            TruthStatus::kOutsideFan, TruthStatus::kOutsideModel}) {
    EXPECT_NE(to_string(status), "");
    EXPECT_TRUE(words.insert(to_string(status)).second) << to_string(status);
  }
  EXPECT_EQ(to_string(TruthStatus::kNoSurface), "no_surface");
}

}  // namespace
}  // namespace striper
