// SPDX-License-Identifier: Apache-2.0
// Proves that two models are said to differ by what they differ by, in metres and in their own
// sigmas, and that models of different cameras are not compared.
#include <gtest/gtest.h>

#include <striper/adjust/solve_joint.hpp>
#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/report/model_diff.hpp>

#include "support/models.hpp"

namespace striper {
namespace {

StriperModel with_covariance(StriperModel model, double variance) {
  std::vector<std::string> names = covariance_names(model.camera, 1);
  const auto size = static_cast<Eigen::Index>(names.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  matrix(size - 1, size - 1) = variance;
  model.covariance = ModelCovariance{std::move(names), matrix};
  return model;
}

StriperModel at_distance(double distance_m) {
  StriperModel model = testing::typical_model();
  model.lasers[0].plane = LaserPlane(model.lasers[0].plane.normal(), distance_m);
  return model;
}

TEST(CompareModels, FindsNoDifferenceOfAModelToItself) {
  const StriperModel model = testing::typical_model();
  const ModelDifference difference = compare_models(model, model, 0);
  EXPECT_GT(difference.pixels.size(), 100U);
  EXPECT_EQ(0.0, difference.worst_m);
  EXPECT_TRUE(std::isnan(difference.rms_sigmas)) << "without covariances there are no sigmas";
}

TEST(CompareModels, ScalesRangesWithThePlanesDistance) {
  // Every range is proportional to the distance of the plane: 2 mm of 0.5 m are 0.4 %.
  const ModelDifference difference = compare_models(at_distance(0.5), at_distance(0.502), 0);
  for (const PixelDifference& at : difference.pixels) {
    EXPECT_NEAR(at.difference_m, 0.004 * at.range_m, 1e-9);
    EXPECT_GE(at.apart_m, 0.9 * at.difference_m);
    EXPECT_LE(at.range_m, 10.0);
  }
  EXPECT_EQ(difference.worst_m, std::abs(difference.worst.difference_m));
  EXPECT_GE(difference.worst_m, difference.rms_m);
}

TEST(CompareModels, CountsInSigmasOfBoth) {
  const StriperModel a = with_covariance(at_distance(0.5), 1e-6);
  const StriperModel b = with_covariance(at_distance(0.502), 1e-6);
  // 2 mm apart, each known to 1 mm.
  EXPECT_NEAR(compare_models(a, b, 0).rms_sigmas, 2.0 / std::sqrt(2.0), 0.01);
}

TEST(CompareModels, LeavesOutWhatIsTooFar) {
  for (const PixelDifference& at :
       compare_models(at_distance(0.5), at_distance(0.6), 0, 2.0).pixels)
    EXPECT_LE(at.range_m, 2.0);
}

TEST(CompareModels, RefusesOtherCamerasAndLasers) {
  StriperModel other = testing::typical_model();
  other.camera = CameraModel(320, 240, 300.0, 300.0, 159.5, 119.5);
  EXPECT_THROW(compare_models(testing::typical_model(), other, 0), Error);
  EXPECT_THROW(compare_models(testing::typical_model(), testing::typical_model(), 1), Error);
}

}  // namespace
}  // namespace striper
