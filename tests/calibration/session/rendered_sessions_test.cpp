// SPDX-License-Identifier: Apache-2.0
// Proves from end to end that the error bars hold: ten sessions are rendered, each is calibrated
// from its images alone, and with that model a scene it has never seen is scanned; the errors of
// the ranges are then as large as sigma and sigma_cal together say. The sessions and the scene come
// from the simulator, so lens, board and laser plane are what the model takes them for.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <striper/core/statistics.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/pipeline/scanner.hpp>

#include "support/random.hpp"
#include "support/simulated_session.hpp"

namespace striper {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kSessions = 10;
constexpr int kImages = 10;

// The session of data/scenes/calibration.yaml with the board carried another way each time.
Scene calibration_scene(int session) {
  Scene scene = testing::calibration_scene();
  scene.seed = 1000 + static_cast<std::uint64_t>(session);
  SceneObject& board = scene.objects.at(0);
  board.T_world_object.linear() =
      Eigen::AngleAxisd(testing::uniform(0.0, 360.0) * kDegree, Eigen::Vector3d::UnitX()) *
      board.T_world_object.linear();
  board.T_world_object.translation() += Eigen::Vector3d(
      testing::uniform(-0.05, 0.05), testing::uniform(-0.03, 0.03), testing::uniform(-0.02, 0.02));
  board.motion.angular_velocity_rad_s *= testing::uniform(0.8, 1.2);
  return scene;
}

// The same striper before a wall that runs from one side at 1.2 m to the other at 2 m.
Scene slanted_wall(int session) {
  Scene scene = testing::calibration_scene();
  scene.seed = 2000 + static_cast<std::uint64_t>(session);
  SceneObject wall;
  wall.name = "wall";
  wall.material.reflectance = 0.7;
  wall.T_world_object.linear() = rotation_from_rpy(0.0, 0.0, 25.0 * kDegree);
  wall.T_world_object.translation() = Eigen::Vector3d(1.55, 0.0, 0.0);
  scene.objects = {wall};
  return scene;
}

// The errors of one scan's ranges, and what the model says of each; parallel arrays.
struct RangeErrors {
  std::vector<double> error_m;
  std::vector<double> random_m;           // sigma_m,
  std::vector<double> total_m;            // and with sigma_cal_m.
  std::vector<Eigen::VectorXd> gradient;  // Of the range over the calibration's parameters.
};

// Every good return but those where the wall ends.
RangeErrors scan_with(StriperModel model, int session) {
  Simulator simulator(slanted_wall(session));
  model.noise = simulator.model().noise;
  ScannerOptions options = ScannerOptions::for_model(model);
  options.ambient.pattern = simulator.scene().timing.pattern;
  Scanner scanner(model, options);
  const Triangulator triangulator(model, 0);
  const Truth truth = simulator.truth(0).at(0);
  RangeErrors errors;
  for (const PolarScan& scan : scanner.process(simulator.render(0)))
    for (std::size_t i = 0; i < scan.returns.size(); ++i) {
      const Return& r = scan.returns[i];
      const TrueLine& line = truth.lines.at(i);
      if (r.status != ReturnStatus::kOk || line.status != TruthStatus::kVisible) continue;
      if (line.brightest.near_edge) continue;
      const TriangulationGradient d = triangulator.gradient({r.u_px, r.v_px});
      const Eigen::RowVector2d outward(r.x_m / r.range_m, r.y_m / r.range_m);
      Eigen::VectorXd gradient(d.d_camera.cols() + 4);
      gradient << (outward * d.d_camera).transpose(), (outward * d.d_plane).transpose();
      errors.error_m.push_back(r.range_m - line.brightest.range_m);
      errors.random_m.push_back(r.sigma_m);
      errors.total_m.push_back(std::hypot(r.sigma_m, r.sigma_cal_m));
      errors.gradient.push_back(std::move(gradient));
    }
  return errors;
}

// The mean of e^2 / (sigma^2 + sigma_cal^2) and its variance where the error bars hold: the errors
// of one scan share one calibration, so they say less than their number.
struct MeanSquare {
  double value = 0.0;
  double variance = 0.0;
  double share_of_calibration = 0.0;
};

MeanSquare mean_square(const RangeErrors& errors, const Eigen::MatrixXd& covariance) {
  MeanSquare mean;
  const auto n = static_cast<double>(errors.error_m.size());
  for (std::size_t i = 0; i < errors.error_m.size(); ++i) {
    const double random2 = std::pow(errors.random_m[i], 2.0);
    mean.value += std::pow(errors.error_m[i] / errors.total_m[i], 2.0) / n;
    mean.share_of_calibration += (1.0 - random2 / std::pow(errors.total_m[i], 2.0)) / n;
    const Eigen::VectorXd Cg = covariance * errors.gradient[i];
    for (std::size_t k = 0; k < errors.error_m.size(); ++k) {
      const double shared = errors.gradient[k].dot(Cg) + (i == k ? random2 : 0.0);
      mean.variance += 2.0 * std::pow(shared / (errors.total_m[i] * errors.total_m[k]) / n, 2.0);
    }
  }
  return mean;
}

TEST(RenderedSessions, RangesOfTenCalibrationsErrByWhatTheirErrorBarsSay) {
  double mean = 0.0;
  double variance = 0.0;
  for (int session = 0; session < kSessions; ++session) {
    const Calibration calibration =
        calibrate(testing::simulated_session(calibration_scene(session), kImages), {});
    ASSERT_TRUE(calibration.trustworthy()) << calibration.verdict();
    ASSERT_TRUE(calibration.model.covariance.has_value());
    const RangeErrors errors = scan_with(calibration.model, session);
    ASSERT_GT(errors.error_m.size(), 250U);
    const MeanSquare one = mean_square(errors, calibration.model.covariance->matrix);
    std::printf(
        "session %d: %2zu boards, corners %.3f px, %zu stripes x%.2f; %zu returns, "
        "e^2/(sigma^2 + sigma_cal^2) = %.2f +- %.2f, %2.0f %% of the variance calibration\n",
        session, calibration.observations.views.size(), calibration.solution.corners.rms_px,
        calibration.observations.stripes.size(), calibration.solution.stripes.sigma_factor,
        errors.error_m.size(), one.value, std::sqrt(one.variance),
        100.0 * one.share_of_calibration);
    mean += one.value / kSessions;
    variance += one.variance / (kSessions * kSessions);
  }
  // Chi-square with as many degrees of freedom as give this variance (Satterthwaite 1946).
  const double dof = 2.0 / variance;
  const double low = chi2_quantile(0.005, dof) / dof;
  const double high = chi2_quantile(0.995, dof) / dof;
  std::printf("mean %.3f, 99 %% band %.3f to %.3f (%.1f degrees of freedom)\n", mean, low, high,
              dof);
  EXPECT_GE(mean, low);
  EXPECT_LE(mean, high);
}

}  // namespace
}  // namespace striper
