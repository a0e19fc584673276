// SPDX-License-Identifier: Apache-2.0
// Proves the frames and lenses of a scene, that a scene made by hand is checked like one from a
// file (whose messages scene_yaml_test.cpp has, all of them), and what sun and sky put into the
// image.
#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/simulator/scene.hpp>
#include <striper/simulator/simulator.hpp>

#include "capture/simulator/lit_scene.hpp"
#include "support/error_of.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::lit_scene;
using testing::object;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = std::numbers::pi / 180.0;

// The angle between the rays through the left and the right edge of the image.
double angle_across_deg(const CameraModel& camera) {
  const double v = 0.5 * (camera.height() - 1);
  const auto ray = [&](double u) {
    return Vector3d(camera.unproject({u, v}).xy.homogeneous()).normalized();
  };
  return std::acos(ray(-0.5).dot(ray(camera.width() - 0.5))) / kDegree;
}

TEST(SceneCamera, SeesTheFieldOfViewThatIsAskedFor) {
  for (const double fov_deg : {1.0, 55.0, 105.0}) {
    EXPECT_NEAR(angle_across_deg(Scene::pinhole(640, 480, fov_deg)), fov_deg, 1e-6);
    EXPECT_NEAR(angle_across_deg(Scene::fisheye(640, 480, fov_deg)), fov_deg, 1e-6);
  }
}

TEST(SceneCamera, FisheyeHasEqualAnglesPerPixel) {
  const CameraModel camera = Scene::fisheye(640, 480, 105.0);
  for (const double u : {0.0, 100.0, 319.0, 500.0, 639.0}) {
    const double angle = std::atan(camera.unproject({u, 239.5}).xy.x());
    EXPECT_NEAR(angle, (u - 319.5) / 640.0 * 105.0 * kDegree, 1e-9) << u;
  }
}

TEST(SceneCamera, FieldOfViewOfNothingOrAHalfTurnIsRefused) {
  for (const double fov_deg : {0.0, -10.0, 180.0, kNan}) {
    for (const auto make : {&Scene::pinhole, &Scene::fisheye}) {
      const Error error = testing::error_of([&] { make(640, 480, fov_deg); });
      EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
      EXPECT_THAT(error.what(), HasSubstr("expected more than 0 and less than 180"));
    }
  }
}

// The device: x forward, y left, z up. The camera: x right, y down, z forward.
TEST(SceneCamera, LooksAlongTheDevicesXTurnedByItsRotation) {
  Scene scene;
  const Eigen::Isometry3d level = scene.T_device_cam();
  EXPECT_EQ(level * Vector3d::UnitZ(), Vector3d(Vector3d::UnitX()));
  EXPECT_EQ(level * Vector3d::UnitX(), Vector3d(-Vector3d::UnitY()));
  EXPECT_EQ(level * Vector3d::UnitY(), Vector3d(-Vector3d::UnitZ()));
  scene.camera_rotation = rotation_from_rpy(0.0, 30.0 * kDegree, 0.0);  // Down.
  const Vector3d ahead = scene.T_device_cam() * Vector3d::UnitZ();
  EXPECT_TRUE(ahead.isApprox(Vector3d(std::cos(30.0 * kDegree), 0.0, -0.5), 1e-12));
}

TEST(Scene, IsStaticWhileNothingMoves) {
  Scene scene = Scene::flat_wall(2.0);
  scene.objects.push_back(object(Box{}, {1.0, 0.0, 0.0}));
  EXPECT_TRUE(scene.is_static());
  scene.objects[1].motion.angular_velocity_rad_s.z() = 1e-9;
  EXPECT_FALSE(scene.is_static());
  scene.objects.pop_back();
  scene.device_motion.velocity_m_s.x() = -1e-9;
  EXPECT_FALSE(scene.is_static());
}

template <typename Change>
std::string refusal(const Change& change) {
  Scene scene = Scene::flat_wall(2.0);
  change(scene);
  const Error error = testing::error_of([&] { scene.validate(); });
  EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
  return error.what();
}

TEST(SceneValidate, AcceptsWhatComesReadyMade) {
  EXPECT_NO_THROW(Scene().validate());
  EXPECT_NO_THROW(Scene::flat_wall(2.0).validate());
}

// What no file can say: its poses are made of angles.
TEST(SceneValidate, PosesMustBeRotations) {
  EXPECT_THAT(refusal([](Scene& s) { s.camera_rotation *= 1.001; }),
              HasSubstr("camera.rotation_deg: 0.003"));
  EXPECT_THAT(refusal([](Scene& s) { s.T_world_device.linear().col(0) *= -1.0; }),
              HasSubstr("device.rotation_deg: 0 - expected a rotation matrix"))
      << "a mirror";
  EXPECT_THAT(refusal([](Scene& s) { s.objects[0].T_world_object.linear().setZero(); }),
              HasSubstr("objects[0].rotation_deg"));
  EXPECT_THAT(refusal([](Scene& s) { s.lasers[0].T_device_laser.translation().y() = kNan; }),
              HasSubstr("lasers[0].position_m: nan - expected a finite number"));
}

TEST(SceneValidate, NoNumberMayBeUnknown) {
  EXPECT_THAT(refusal([](Scene& s) { s.imager.blur_sigma_px = kNan; }),
              HasSubstr("imager.blur_px: nan - expected a number from 0 to 20"));
  EXPECT_THAT(refusal([](Scene& s) { s.daylight.sun_direction.setZero(); }),
              HasSubstr("daylight.sun_direction: 0 - expected a number above 0"));
  EXPECT_THAT(refusal([](Scene& s) { s.lasers[0].focus_m = 1.0; }),
              HasSubstr("a focus of no thickness is infinitely bright"));
  EXPECT_THAT(refusal([](Scene& s) { s.timing.pattern = IlluminationPattern(); }),
              HasSubstr("timing.cadence: 'auto'"));
}

TEST(SimulatedSun, BoxCastsTheShadowThatGeometryGives) {
  Scene scene = lit_scene();
  scene.daylight.ambient_w_m2_nm = 0.1;
  scene.daylight.sun_w_m2_nm = 1.0;
  scene.daylight.sun_direction = {-1.0, 1.0, 0.0};  // From behind left, level.
  scene.objects.push_back(object(Plane{}, {3.0, 0.0, 0.0}));
  scene.objects.push_back(object(Rectangle{0.2, 4.0}, {2.0, 0.0, 0.0}));
  const cv::Mat image = Simulator(scene).expected_dn(0);
  const double f = scene.camera.fx();
  const auto at = [&](double y_m) {
    return image.at<float>(240, static_cast<int>(std::lround(319.5 - f * y_m / 3.0)));
  };
  // The plate at x = 2, |y| < 0.1 throws its shadow 1 m on and 1 m to the right: y = -1.1 to -0.9.
  const double sunlit = at(0.7);
  const double ratio = (0.1 + std::sqrt(0.5)) / 0.1;
  EXPECT_NEAR(sunlit / at(-1.0), ratio, 1e-4);
  EXPECT_NEAR(at(-1.12), sunlit, 1e-4 * sunlit);
  EXPECT_NEAR(at(-0.88), sunlit, 1e-4 * sunlit);
  EXPECT_NEAR(sunlit / at(-1.09), ratio, 1e-4);
  scene.daylight.shadows = false;
  const cv::Mat without = Simulator(scene).expected_dn(0);
  const int column = static_cast<int>(std::lround(319.5 + f / 3.0));
  EXPECT_NEAR(without.at<float>(240, column), sunlit, 1e-4 * sunlit);
}

TEST(SimulatedSky, LightsTheGroundTwiceAsMuchAsAWall) {
  Scene scene = lit_scene();
  scene.daylight.ambient_w_m2_nm = 0.0;
  scene.daylight.sky_w_m2_nm = 1.0;
  scene.daylight.sky_radiance_w_m2_sr_nm = 0.25;
  scene.objects.push_back(object(Rectangle{10.0, 1.0}, {3.0, 0.0, 0.0}));
  scene.objects.push_back(object(Plane{}, {0.0, 0.0, -0.5}));
  scene.objects[1].T_world_object.linear() = facing(Vector3d::UnitZ());
  const cv::Mat image = Simulator(scene).expected_dn(0);
  const double wall = image.at<float>(240, 320);
  EXPECT_NEAR(image.at<float>(450, 320) / wall, 2.0, 1e-5);
  EXPECT_NEAR(image.at<float>(5, 320) / wall, 0.25 / (0.5 * 0.5 / M_PI), 1e-5);  // Sky itself.
}

}  // namespace
}  // namespace striper
