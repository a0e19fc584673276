// SPDX-License-Identifier: Apache-2.0
// Proves that project and unproject are each other's inverse to 1e-9 px over whole images of every
// lens model, that they agree with OpenCV, that the limit of the one-to-one region is where the
// Jacobian's determinant changes sign, that nothing comes back beyond it, and that the Jacobians
// are those of numeric differences. It does not prove that a calibration of a real lens is right.
#include <cmath>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include <striper/core/error.hpp>
#include <striper/model/camera_model.hpp>

#include "support/error_of.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using testing::uniform;

struct Case {
  std::string name;
  CameraModel camera;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

// 105 degrees across 640 columns: 52.5 degrees at the left and right border.
CameraModel wide_lens() {
  return {640,
          480,
          349.2,
          349.2,
          319.5,
          239.5,
          LensModel::kEquidistant,
          {-0.012, 0.004, -0.0021, 0.0004}};
}

std::vector<Case> one_to_one_cases() {
  return {
      {"pinhole", {640, 480, 620.0, 619.0, 320.9, 238.0}},
      {"turntable",
       {640,
        480,
        620.15780229,
        619.10719962,
        320.9020089,
        238.02325834,
        LensModel::kPlumbBob,
        {0.13029695, -0.29739164, -0.001742, -0.00061009, 0.17176935}}},
      {"barrel",
       {1280,
        960,
        900.0,
        905.0,
        640.0,
        470.0,
        LensModel::kPlumbBob,
        {-0.28, 0.11, 0.0, 0.0, -0.02}}},
      {"strongly_tangential",
       {640,
        480,
        500.0,
        500.0,
        300.0,
        260.0,
        LensModel::kPlumbBob,
        {-0.2, 0.05, 0.02, -0.03, 0.0}}},
      {"rational",
       {1920,
        1080,
        1000.0,
        1001.0,
        955.0,
        541.0,
        LensModel::kRationalPolynomial,
        {1.2, 0.4, 0.0004, -0.0002, 0.02, 1.5, 0.7, 0.08}}},
      {"rational_wide",
       {640,
        480,
        250.0,
        250.0,
        320.0,
        240.0,
        LensModel::kRationalPolynomial,
        {0.6, 0.05, 0.0, 0.0, 0.001, 0.9, 0.2, 0.008}}},
      {"equidistant_105_degrees", wide_lens()},
      {"equidistant_162_degrees_across_corners",
       {1000,
        1000,
        500.0,
        500.0,
        500.0,
        499.0,
        LensModel::kEquidistant,
        {0.01, -0.003, 0.001, -0.0002}}},
  };
}

class EveryLens : public ::testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(CameraModel, EveryLens, ::testing::ValuesIn(one_to_one_cases()),
                         [](const auto& instance) { return instance.param.name; });

TEST_P(EveryLens, RoundTripsToANanopixelOverTheWholeImage) {
  const CameraModel& camera = GetParam().camera;
  EXPECT_FALSE(camera.folds_inside_image());
  double worst = 0.0;
  for (int row = 0; 3.7 * row < camera.height(); ++row) {
    for (int column = 0; 4.3 * column < camera.width(); ++column) {
      const double v = 3.7 * row;
      const double u = 4.3 * column;
      const Unprojection ray = camera.unproject({u, v});
      ASSERT_EQ(ray.status, CameraStatus::kOk) << u << ", " << v;
      const Projection pixel = camera.project(ray.xy.homogeneous());
      ASSERT_EQ(pixel.status, CameraStatus::kOk) << u << ", " << v;
      worst = std::max(worst, (pixel.pixel - Eigen::Vector2d(u, v)).norm());
    }
  }
  EXPECT_LT(worst, 1e-9);
}

TEST_P(EveryLens, ProjectsWhereOpenCvDoes) {
  const CameraModel& camera = GetParam().camera;
  const cv::Matx33d K(camera.fx(), 0, camera.cx(), 0, camera.fy(), camera.cy(), 0, 0, 1);
  const cv::Mat k(camera.distortion());
  for (int i = 0; i < 200; ++i) {
    const double u = uniform(0.0, camera.width() - 1);
    const double v = uniform(0.0, camera.height() - 1);
    const Eigen::Vector2d xy = camera.unproject({u, v}).xy;
    const double z = uniform(0.2, 8.0);
    const std::vector<cv::Point3d> points{{xy.x() * z, xy.y() * z, z}};
    std::vector<cv::Point2d> pixels;
    if (camera.lens() == LensModel::kEquidistant) {
      cv::fisheye::projectPoints(points, pixels, cv::Vec3d(), cv::Vec3d(), K, k);
    } else {
      cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), K, k, pixels);
    }
    EXPECT_NEAR(pixels[0].x, u, 1e-9);
    EXPECT_NEAR(pixels[0].y, v, 1e-9);
  }
}

TEST_P(EveryLens, UnprojectsWhereOpenCvDoes) {
  const CameraModel& camera = GetParam().camera;
  const cv::Matx33d K(camera.fx(), 0, camera.cx(), 0, camera.fy(), camera.cy(), 0, 0, 1);
  const cv::Mat k(camera.distortion());
  // OpenCV iterates to a fixed point, which converges in the middle of the image at least.
  for (int i = 0; i < 200; ++i) {
    const double u = camera.cx() + uniform(-0.15, 0.15) * camera.width();
    const double v = camera.cy() + uniform(-0.15, 0.15) * camera.height();
    const std::vector<cv::Point2d> pixels{{u, v}};
    std::vector<cv::Point2d> rays;
    const cv::TermCriteria enough(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 500, 1e-14);
    if (camera.lens() == LensModel::kEquidistant) {
      cv::fisheye::undistortPoints(pixels, rays, K, k);
    } else {
      cv::undistortPoints(pixels, rays, K, k, cv::noArray(), cv::noArray(), enough);
    }
    const Eigen::Vector2d xy = camera.unproject({u, v}).xy;
    EXPECT_NEAR(rays[0].x, xy.x(), 1e-8);
    EXPECT_NEAR(rays[0].y, xy.y(), 1e-8);
  }
}

TEST_P(EveryLens, JacobiansAreThoseOfNumericDifferences) {
  const CameraModel& camera = GetParam().camera;
  const Eigen::VectorXd parameters = camera.parameters();
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d q(uniform(0.0, camera.width() - 1), uniform(0.0, camera.height() - 1));
    const Eigen::Vector3d ray = camera.unproject(q).xy.homogeneous();
    const Eigen::Vector3d p_cam = ray * uniform(0.3, 5.0);
    Eigen::Matrix<double, 2, 3> J_point;
    Eigen::Matrix<double, 2, Eigen::Dynamic> J_parameters;
    const Projection result = camera.project(p_cam, &J_point, &J_parameters);
    ASSERT_EQ(result.status, CameraStatus::kOk);
    EXPECT_LT((result.pixel - q).norm(), 1e-9);
    ASSERT_EQ(J_parameters.cols(), parameters.size());
    constexpr double kStep = 1e-5;
    for (int j = 0; j < 3; ++j) {
      const Eigen::Vector3d step = kStep * p_cam.z() * Eigen::Vector3d::Unit(j);
      const Eigen::Vector2d difference =
          (camera.project(p_cam + step).pixel - camera.project(p_cam - step).pixel) /
          (2.0 * step[j]);
      EXPECT_LT((J_point.col(j) - difference).norm(), 1e-5 * (1.0 + difference.norm()));
    }
    for (Eigen::Index j = 0; j < parameters.size(); ++j) {
      Eigen::VectorXd high = parameters;
      Eigen::VectorXd low = parameters;
      high[j] += kStep;
      low[j] -= kStep;
      const Eigen::Vector2d difference = (camera.with_parameters(high).project(p_cam).pixel -
                                          camera.with_parameters(low).project(p_cam).pixel) /
                                         (2.0 * kStep);
      EXPECT_LT((J_parameters.col(j) - difference).norm(), 1e-5 * (1.0 + difference.norm()))
          << camera.parameter_names()[static_cast<std::size_t>(j)];
    }
  }
}

TEST_P(EveryLens, PrincipalPointIsTheOpticalAxis) {
  const CameraModel& camera = GetParam().camera;
  const Unprojection ray = camera.unproject({camera.cx(), camera.cy()});
  EXPECT_EQ(ray.status, CameraStatus::kOk);
  EXPECT_LT(ray.xy.norm(), 1e-15);
  Eigen::Matrix<double, 2, 3> J_point;
  EXPECT_EQ(camera.project({0.0, 0.0, 2.0}, &J_point, nullptr).pixel,
            Eigen::Vector2d(camera.cx(), camera.cy()));
  EXPECT_TRUE(J_point.allFinite());
}

TEST(CameraModel, LimitIsWhereTheRadialDerivativeVanishes) {
  // r (1 + k1 r^2): the derivative 1 + 3 k1 r^2 is zero at r = 1 / sqrt(-3 k1).
  const CameraModel brown(640, 480, 400.0, 400.0, 320.0, 240.0, LensModel::kPlumbBob,
                          {-0.5, 0.0, 0.0, 0.0, 0.0});
  EXPECT_NEAR(brown.max_theta_rad(), std::atan(1.0 / std::sqrt(1.5)), 1e-15);
  const CameraModel fisheye(640, 480, 400.0, 400.0, 320.0, 240.0, LensModel::kEquidistant,
                            {-0.3, 0.0, 0.0, 0.0});
  EXPECT_NEAR(fisheye.max_theta_rad(), 1.0 / std::sqrt(0.9), 1e-15);
}

TEST(CameraModel, LimitOfARationalLensIsBeforeItsPole) {
  // 1 / (1 - r^2) has its pole at r = 1, and rises all the way.
  const CameraModel camera(640, 480, 400.0, 400.0, 320.0, 240.0, LensModel::kRationalPolynomial,
                           {0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0});
  EXPECT_NEAR(camera.max_theta_rad(), std::atan(1.0), 1e-12);
  EXPECT_EQ(camera.unproject({1e7, 240.0}).status, CameraStatus::kOk);
  EXPECT_EQ(camera.project({1.001, 0.0, 1.0}).status, CameraStatus::kBeyondModel);
}

TEST(CameraModel, PinholeSeesUpToARightAngle) {
  const CameraModel camera(640, 480, 400.0, 400.0, 320.0, 240.0);
  EXPECT_LT(camera.max_theta_rad(), std::numbers::pi / 2);
  EXPECT_GT(camera.max_theta_rad(), 1.5707);
  EXPECT_EQ(camera.project({0.0, 0.0, -1.0}).status, CameraStatus::kBehindCamera);
  EXPECT_EQ(camera.project({1.0, 0.0, 0.0}).status, CameraStatus::kBehindCamera);
  EXPECT_TRUE(std::isnan(camera.project({1.0, 0.0, 0.0}).pixel.x()));
}

TEST(CameraModel, EquidistantPixelBeyondARightAngleHasNoRay) {
  const CameraModel camera(1000, 1000, 200.0, 200.0, 500.0, 500.0, LensModel::kEquidistant);
  const Unprojection ray = camera.unproject({500.0 + 200.0 * 1.6, 500.0});
  EXPECT_EQ(ray.status, CameraStatus::kBehindCamera);
  EXPECT_TRUE(std::isnan(ray.xy.x()) && std::isnan(ray.xy.y()));
  EXPECT_EQ(camera.unproject({500.0 + 200.0 * 1.57, 500.0}).status, CameraStatus::kOk);
  EXPECT_TRUE(camera.folds_inside_image());
}

TEST(CameraModel, GivesNanAndTheReasonBeyondTheFold) {
  const CameraModel camera(640, 480, 400.0, 400.0, 320.0, 240.0, LensModel::kPlumbBob,
                           {-0.5, 0.0, 0.0, 0.0, 0.0});
  const double fold_r = 1.0 / std::sqrt(1.5);
  const double fold_px = 400.0 * fold_r * (1.0 - 0.5 * fold_r * fold_r);
  EXPECT_EQ(camera.unproject({320.0 + fold_px - 1e-6, 240.0}).status, CameraStatus::kOk);
  const Unprojection beyond = camera.unproject({320.0 + fold_px + 1e-6, 240.0});
  EXPECT_EQ(beyond.status, CameraStatus::kBeyondModel);
  EXPECT_TRUE(std::isnan(beyond.xy.x()) && std::isnan(beyond.xy.y()));
  EXPECT_EQ(camera.project({fold_r + 1e-6, 0.0, 1.0}).status, CameraStatus::kBeyondModel);
  EXPECT_TRUE(camera.folds_inside_image());
}

// The naive way: is the determinant of the numeric Jacobian positive all along the ray?
bool is_one_to_one_by_sampling(const std::vector<double>& k, const Eigen::Vector2d& xy) {
  const auto map = [&k](double x, double y) {
    const double r2 = x * x + y * y;
    const double g = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    return Eigen::Vector2d(x * g + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
                           y * g + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y);
  };
  for (int i = 0; i <= 400; ++i) {
    const Eigen::Vector2d at = xy * (i / 400.0);
    constexpr double kStep = 1e-6;
    Eigen::Matrix2d J;
    J.col(0) = (map(at.x() + kStep, at.y()) - map(at.x() - kStep, at.y())) / (2.0 * kStep);
    J.col(1) = (map(at.x(), at.y() + kStep) - map(at.x(), at.y() - kStep)) / (2.0 * kStep);
    if (J.determinant() <= 0.0) return false;
  }
  return true;
}

TEST(CameraModel, TangentialFoldIsWhereTheDeterminantChangesSign) {
  const std::vector<double> k{-0.35, 0.08, 0.03, -0.05, 0.0};
  const CameraModel camera(640, 480, 300.0, 300.0, 320.0, 240.0, LensModel::kPlumbBob, k);
  int agreed = 0;
  int one_to_one = 0;
  constexpr int kPoints = 4000;
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector2d xy(uniform(-1.8, 1.8), uniform(-1.8, 1.8));
    const bool ours = camera.project(xy.homogeneous()).status == CameraStatus::kOk;
    one_to_one += ours ? 1 : 0;
    agreed += ours == is_one_to_one_by_sampling(k, xy) ? 1 : 0;
  }
  EXPECT_GE(agreed, kPoints - 5);
  EXPECT_GT(one_to_one, kPoints / 4);
  EXPECT_LT(one_to_one, 9 * kPoints / 10);
}

TEST(CameraModel, UnprojectsUpToATangentialFold) {
  const CameraModel camera(640, 480, 300.0, 300.0, 320.0, 240.0, LensModel::kPlumbBob,
                           {-0.35, 0.08, 0.03, -0.05, 0.0});
  int found = 0;
  int tried = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector2d xy(uniform(-1.8, 1.8), uniform(-1.8, 1.8));
    const Projection pixel = camera.project(xy.homogeneous());
    if (pixel.status != CameraStatus::kOk) continue;
    ++tried;
    const Unprojection ray = camera.unproject(pixel.pixel);
    if (ray.status != CameraStatus::kOk) continue;
    ++found;
    EXPECT_LT((camera.project(ray.xy.homogeneous()).pixel - pixel.pixel).norm(), 1e-9);
  }
  EXPECT_EQ(found, tried);
}

// Newton's method alone runs in circles on some rational lenses, and beside a pole.
TEST(CameraModel, UnprojectsWhateverARandomLensProjects) {
  for (int lens = 0; lens < 3; ++lens) {
    for (int i = 0; i < 300; ++i) {
      const double scale = i % 2 == 0 ? 0.05 : 1.0;
      std::vector<double> k(static_cast<std::size_t>(distortion_count(LensModel(lens))));
      for (double& c : k) c = uniform(-scale, scale);
      if (lens < 2) k[2] = k[3] = i % 3 == 0 ? 0.0 : uniform(-0.001, 0.001);
      const CameraModel camera(640, 480, 600.0, 600.0, 320.0, 240.0, LensModel(lens), k);
      for (int j = 0; j < 100; ++j) {
        const Eigen::Vector3d ray(uniform(-2.0, 2.0), uniform(-2.0, 2.0), 1.0);
        const Projection pixel = camera.project(ray);
        if (pixel.status != CameraStatus::kOk || pixel.pixel.norm() > 1e4) continue;
        const Unprojection back = camera.unproject(pixel.pixel);
        ASSERT_EQ(back.status, CameraStatus::kOk) << ::testing::PrintToString(k);
        ASSERT_LT((camera.project(back.xy.homogeneous()).pixel - pixel.pixel).norm(), 1e-8)
            << ::testing::PrintToString(k);
      }
    }
  }
}

TEST(CameraModel, RefusesNanPixels) {
  for (const Case& c : one_to_one_cases()) {
    EXPECT_NE(c.camera.unproject({std::nan(""), 3.0}).status, CameraStatus::kOk) << c.name;
    EXPECT_NE(c.camera.project({std::nan(""), 3.0, 1.0}).status, CameraStatus::kOk) << c.name;
    EXPECT_NE(c.camera.project({0.0, 0.0, std::nan("")}).status, CameraStatus::kOk) << c.name;
    EXPECT_NE(c.camera.unproject({INFINITY, 3.0}).status, CameraStatus::kOk) << c.name;
  }
}

std::string message_of(int width, double fx, LensModel lens, std::vector<double> k) {
  const Error error = testing::error_of(
      [&] { CameraModel(width, 480, fx, 600.0, 320.0, 240.0, lens, std::move(k)); });
  EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
  return error.what();
}

TEST(CameraModel, RefusesWhatIsNoCamera) {
  EXPECT_EQ(message_of(0, 600.0, LensModel::kPlumbBob, {}),
            "camera: image width is 0 - expected 1 to 100000 pixels");
  EXPECT_EQ(message_of(640, -1.0, LensModel::kPlumbBob, {}),
            "camera: focal length fx is -1 - expected a finite number above 0");
  EXPECT_EQ(message_of(640, std::nan(""), LensModel::kPlumbBob, {}),
            "camera: focal length fx is nan - expected a finite number above 0");
  EXPECT_EQ(message_of(640, 600.0, LensModel::kEquidistant, {0.0, 0.0, 0.0, 0.0, 0.0}),
            "camera: number of distortion coefficients is 5 - expected 4 for equidistant");
  EXPECT_EQ(message_of(640, 600.0, LensModel::kPlumbBob, {0.0, 0.0, INFINITY, 0.0, 0.0}),
            "camera: distortion coefficient p1 is inf - expected a finite number of magnitude up "
            "to 1000000000");
}

TEST(CameraModel, WithItsOwnParametersIsEqual) {
  for (const Case& c : one_to_one_cases()) {
    EXPECT_EQ(c.camera.with_parameters(c.camera.parameters()), c.camera) << c.name;
    EXPECT_EQ(static_cast<Eigen::Index>(c.camera.parameter_names().size()),
              c.camera.parameters().size());
  }
  EXPECT_THROW(wide_lens().with_parameters(Eigen::VectorXd::Ones(9)), Error);
}

TEST(LensModel, WordsReadBack) {
  for (const LensModel lens :
       {LensModel::kPlumbBob, LensModel::kRationalPolynomial, LensModel::kEquidistant}) {
    EXPECT_EQ(lens_model_from_string(to_string(lens)), lens);
  }
  EXPECT_EQ(lens_model_from_string("fisheye"), std::nullopt);
}

}  // namespace
}  // namespace striper
