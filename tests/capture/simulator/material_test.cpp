// SPDX-License-Identifier: Apache-2.0
// Proves what surfaces put into the image: checkerboard corners against a corner finder, paint,
// mottling, wood, posters, retroreflection. Does not prove that grass looks like grass.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <striper/simulator/material.hpp>
#include <striper/simulator/simulator.hpp>

#include "capture/simulator/lit_scene.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using Eigen::Vector3d;
using testing::lit_scene;
using testing::object;

/// The image in 8 bits, its brightest pixel at 220.
cv::Mat exposed(const cv::Mat& expected) {
  double most = 0.0;
  cv::minMaxIdx(expected, nullptr, &most);
  cv::Mat image;
  expected.convertTo(image, CV_8U, 220.0 / most);
  return image;
}

TEST(SimulatedBoard, CornersAreWhereACornerFinderSeesThem) {
  const Checkerboard board{.columns = 8, .rows = 6, .square_m = 0.04, .border_m = 0.04};
  for (int trial = 0; trial < 4; ++trial) {
    Scene scene = lit_scene();
    const double f = scene.camera.fx();
    scene.camera = CameraModel(640, 480, f, f, 320.0, 238.0, LensModel::kPlumbBob,
                               {-0.2, 0.05, 1e-3, -5e-4, 0.0});
    scene.imager.blur_sigma_px = 1.0;
    scene.objects.push_back(
        object(Rectangle{0.5, 0.42}, {0.9, testing::uniform(-0.05, 0.05), 0.0}));
    scene.objects[0].material.texture = board;
    scene.objects[0].T_world_object.linear() = rotation_from_rpy(
        testing::uniform(-0.3, 0.3), testing::uniform(-0.5, 0.5), testing::uniform(-0.5, 0.5));
    Simulator simulator(scene);
    const cv::Mat image = exposed(simulator.expected_dn(0));
    std::vector<cv::Point2f> corners;
    ASSERT_TRUE(cv::findChessboardCorners(image, {8, 6}, corners));
    cv::cornerSubPix(image, corners, {5, 5}, {-1, -1},
                     cv::TermCriteria(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 100, 1e-4));
    const Eigen::Isometry3d T_cam_board = simulator.T_cam_object(0, 0);
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    double mean_square = 0.0;
    for (int i = 0; i < board.rows * board.columns; ++i) {
      const Eigen::Vector2d on_face = board.corner_m(i % board.columns, i / board.columns);
      const Vector3d p_board(0.0, -on_face.x(), on_face.y());
      const Eigen::Vector2d truth = scene.camera.project(T_cam_board * p_board).pixel;
      Eigen::Vector2d nearest(100.0, 100.0);
      for (const cv::Point2f& corner : corners) {
        const Eigen::Vector2d error = Eigen::Vector2d(corner.x, corner.y) - truth;
        if (error.norm() < nearest.norm()) nearest = error;
      }
      mean += nearest / 48.0;
      mean_square += nearest.squaredNorm() / 48.0;
    }
    // The finder scatters by some hundredths of a pixel by itself, but about the truth.
    EXPECT_LT(mean.norm(), 0.015);
    EXPECT_LT(std::sqrt(mean_square), 0.06);
  }
}

TEST(SimulatedBoard, IsSeenFromItsFrontWithABlackSquareTopLeftAndAWhiteBorder) {
  Scene scene = lit_scene();
  scene.objects.push_back(object(Rectangle{0.5, 0.42}, {0.9, 0.0, 0.0}));
  scene.objects[0].material.texture = Checkerboard{.columns = 8, .rows = 6};
  scene.objects[0].material.reflectance = 0.5;
  Simulator simulator(scene);
  const cv::Mat image = simulator.expected_dn(0);
  const double scale = scene.camera.fx() / 0.9;
  const auto at = [&](double right_m, double up_m) {
    return image.at<float>(static_cast<int>(std::lround(239.5 - scale * up_m)),
                           static_cast<int>(std::lround(319.5 + scale * right_m)));
  };
  const double white = at(-0.18 - 0.02, 0.0);               // In the border.
  EXPECT_NEAR(at(-0.16, 0.12) / white, 0.05 / 0.85, 1e-5);  // Top left square.
  EXPECT_NEAR(at(-0.12, 0.12) / white, 1.0, 1e-5);
  EXPECT_NEAR(at(0.16, -0.12) / white, 0.05 / 0.85, 1e-5);  // 9 x 7 squares: bottom right too.
  EXPECT_NEAR(at(-0.235, 0.0) / white, 0.5 / 0.85, 1e-5);   // Beyond the border.
}

TEST(SimulatedBoard, PixelsOnAnEdgeHoldTheShareOfEachSide) {
  Scene scene = lit_scene();
  scene.objects.push_back(object(Rectangle{1.0, 1.0}, {1.0, 0.0, 0.0}));
  scene.objects[0].material.texture = Checkerboard{.columns = 1, .rows = 1, .square_m = 0.3};
  for (const double shift_px : {0.0, 0.13, 0.37, 0.5, 0.81}) {
    scene.objects[0].T_world_object.translation().y() = -shift_px / scene.camera.fx();
    const cv::Mat image = Simulator(scene).expected_dn(0);
    // The edge is at u = 319.5 + shift: to its left, above the middle, black.
    const double edge = 319.5 + shift_px;
    const int column = static_cast<int>(std::lround(edge));
    const double share_black = std::clamp(edge - (column - 0.5), 0.0, 1.0);
    const double black = image.at<float>(150, 250);
    const double white = image.at<float>(150, 400);
    const double share = (white - image.at<float>(150, column)) / (white - black);
    EXPECT_NEAR(share, share_black, 1.0 / 64.0) << shift_px;
  }
}

TEST(SimulatedPaint, DashesWearAndOffsetAreAsGiven) {
  Scene scene = lit_scene();
  scene.objects.push_back(object(Plane{}, {2.0, 0.0, 0.0}));
  scene.objects[0].material.reflectance = 0.1;
  PaintedStripe stripe{
      .width_m = 0.2, .offset_m = 0.3, .dash_m = 0.3, .gap_m = 0.2, .reflectance = 0.6};
  scene.objects[0].material.texture = stripe;
  const cv::Mat image = Simulator(scene).expected_dn(0);
  const double px_per_m = scene.camera.fx() / 2.0;
  const auto at = [&](double right_m, double up_m) {
    return image.at<float>(static_cast<int>(std::lround(239.5 - px_per_m * up_m)),
                           static_cast<int>(std::lround(319.5 + px_per_m * right_m)));
  };
  const double ground = at(0.0, 0.1);
  EXPECT_NEAR(at(0.3, 0.1) / ground, 6.0, 1e-4);   // First dash: 0 to 0.3.
  EXPECT_NEAR(at(0.3, 0.4) / ground, 1.0, 1e-4);   // Gap.
  EXPECT_NEAR(at(0.3, 0.55) / ground, 6.0, 1e-4);  // Next dash: from 0.5.
  EXPECT_NEAR(at(0.3, -0.1) / ground, 1.0, 1e-4);  // Gap before the first.
  EXPECT_NEAR(at(0.19, 0.1) / ground, 1.0, 1e-4);
  EXPECT_NEAR(at(0.39, 0.1) / ground, 6.0, 1e-4);

  stripe.dash_m = 0.0;
  stripe.wear = 0.3;
  stripe.grain_m = 0.01;
  scene.objects[0].material.texture = stripe;
  const cv::Mat worn = Simulator(scene).expected_dn(0);
  const cv::Rect inside(static_cast<int>(319.5 + px_per_m * 0.21), 20,
                        static_cast<int>(px_per_m * 0.18), 440);
  const double painted = (cv::mean(worn(inside))[0] / ground - 1.0) / 5.0;
  const double patches = 18.0 * 440.0 / px_per_m / 0.01;
  EXPECT_NEAR(painted, 0.7, 4.0 * std::sqrt(0.3 * 0.7 / patches));
}

TEST(SimulatedMottle, VariesAboutTheReflectanceWithinItsContrast) {
  Scene scene = lit_scene();
  scene.objects.push_back(object(Plane{}, {2.0, 0.0, 0.0}));
  const double plain = Simulator(scene).expected_dn(0).at<float>(0, 0);
  scene.objects[0].material.mottle_contrast = 0.4;
  scene.objects[0].material.mottle_grain_m = 0.05;
  const cv::Mat image = Simulator(scene).expected_dn(0);
  double least = 0.0;
  double most = 0.0;
  cv::minMaxIdx(image, &least, &most);
  EXPECT_GT(least, 0.6 * plain);
  EXPECT_LT(most, 1.4 * plain);
  EXPECT_GT(most - least, 0.4 * plain);
  EXPECT_NEAR(cv::mean(image)[0], plain, 0.02 * plain);
}

cv::Mat wall_of(const Material& material) {
  Scene scene = lit_scene();
  scene.objects.push_back(object(Plane{}, {2.0, 0.0, 0.0}));
  scene.objects[0].material = material;
  return Simulator(scene).expected_dn(0);
}

/// Mean absolute difference of pixels beside each other, and of those below each other.
cv::Vec2d roughness(const cv::Mat& image) {
  const int rows = image.rows;
  const int columns = image.cols;
  return {cv::norm(image.colRange(1, columns), image.colRange(0, columns - 1), cv::NORM_L1),
          cv::norm(image.rowRange(1, rows), image.rowRange(0, rows - 1), cv::NORM_L1)};
}

TEST(SimulatedWood, HasFibresAlongItsDirectionBetweenItsTwoReflectances) {
  const double plain = wall_of({.reflectance = 1.0}).at<float>(240, 320);
  for (const bool is_upright : {false, true}) {
    WoodGrain grain{.fibre_m = 0.03, .length_m = 0.6, .dark = 0.2, .light = 0.7};
    if (is_upright) grain.direction_rad = 0.5 * std::numbers::pi;
    const cv::Mat image = wall_of({.texture = grain});
    double least = 0.0;
    double most = 0.0;
    cv::minMaxIdx(image, &least, &most);
    EXPECT_GT(least, 0.2 * plain * 0.999);
    EXPECT_LT(most, 0.7 * plain * 1.001);
    EXPECT_GT(most - least, 0.3 * plain);
    const cv::Vec2d rough = roughness(image);
    EXPECT_GT(is_upright ? rough[0] / rough[1] : rough[1] / rough[0], 8.0);
  }
}

TEST(SimulatedPoster, HasSharpEdgesThatAreLevelAndUprightAndIsAnotherForAnotherSeed) {
  const double plain = wall_of({.reflectance = 1.0}).at<float>(240, 320);
  const Poster poster{.cell_m = 0.4, .darkest = 0.1, .lightest = 0.8, .seed = 3};
  const cv::Mat image = wall_of({.texture = poster});
  double least = 0.0;
  double most = 0.0;
  cv::minMaxIdx(image, &least, &most);
  EXPECT_GT(least, 0.1 * plain * 0.999);
  EXPECT_NEAR(most, 0.8 * plain, 0.001 * plain);  // Some of the paper is bare.
  EXPECT_LT(least, 0.2 * plain);
  // A pixel is like its left or right neighbour and like the one above or below it; where it is
  // not, an edge runs along it or a corner is in it.
  int alike = 0;
  for (int v = 1; v < image.rows - 1; ++v) {
    for (int u = 1; u < image.cols - 1; ++u) {
      const float middle = image.at<float>(v, u);
      const bool beside =
          middle == image.at<float>(v, u - 1) || middle == image.at<float>(v, u + 1);
      const bool below = middle == image.at<float>(v - 1, u) || middle == image.at<float>(v + 1, u);
      alike += beside && below ? 1 : 0;
    }
  }
  EXPECT_GT(alike, 0.85 * 638 * 478);
  Poster another = poster;
  another.seed = 4;
  EXPECT_GT(cv::norm(image, wall_of({.texture = another}), cv::NORM_L1),
            0.1 * plain * static_cast<double>(image.total()));
}

TEST(SimulatedPaint, BeadsReturnTheLasersLightToACameraBesideIt) {
  // Baseline 0.1 m at 2 m: 2.9 degrees between laser and camera at the wall.
  Scene scene = Scene::flat_wall(2.0);
  scene.lasers[0].T_device_laser.translation().z() = -0.1;
  const double plain = Simulator(scene).truth(0).at(0).lines[320].brightest.amplitude_dn;
  scene.objects[0].material.retro_gain = 8.0;
  scene.objects[0].material.retro_spread_rad = 0.05;
  const TrueReturn beads = Simulator(scene).truth(0).at(0).lines[320].brightest;
  const double angle = std::atan(0.1 / 2.0);
  EXPECT_NEAR(beads.amplitude_dn / plain,
              1.0 + 8.0 * std::exp(-0.5 * angle * angle / (0.05 * 0.05)), 1e-3);
}

}  // namespace
}  // namespace striper
