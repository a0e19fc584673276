// SPDX-License-Identifier: Apache-2.0
// Proves on published images of a stripe on a board that the laser plane comes out as their
// references have it, with the channel and the axis found by themselves: a green stripe on an
// almost white board that is read best from a colour difference, a red stripe clipped to white
// that a colour difference hollows out. Skips where the images are absent.
#include <fstream>

#include <gmock/gmock.h>

#include <striper/laser_plane/initial_plane.hpp>

#include "real_support.hpp"

namespace striper {
namespace {

using ::testing::Contains;
using ::testing::Field;

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 57.29578;
}

// Every return on the line and on the board, before neighbours are averaged, against the plane.
double return_rms_m(const Calibration& c) {
  Observations each = c.observations;
  JointSolution all = c.solution;
  for (const ImageResult& result : c.images) {
    if (result.stripe_view < 0) continue;
    const auto s = static_cast<std::size_t>(result.stripe_view);
    each.stripes[s].pixel = result.stripe.return_px;
    all.stripe_residual_px[s].assign(result.stripe.return_px.size(), 0.0);
  }
  double squares = 0.0;
  double count = 0.0;
  for (const auto& p : stripe_points_cam(each, all, 0)) {
    squares += std::pow(c.model.lasers[0].plane.signed_distance_m(p), 2.0);
    count += 1.0;
  }
  return std::sqrt(squares / count);
}

TEST(RealLasers, SrvsGreenLineComesOutAsItsPointsHaveIt) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("srv-green-laser-turntable");
  const auto set = testing::real_data("srv-green-laser-turntable");
  CalibrationInput boards;
  boards.board = parse_board("8x6", 0.040);
  boards.boards = testing::images_in(set / "camera_180717");
  const Calibration camera = calibrate(boards, {});
  EXPECT_EQ(14U, camera.observations.views.size());
  EXPECT_NEAR(camera.model.camera.fx(), 619.7, 3.0);
  EXPECT_TRUE(camera.model.lasers.empty());

  // As the reference did it: the camera from its own images, held; its error is added afterwards.
  CalibrationInput lasers;
  lasers.board = boards.board;
  lasers.lasers.push_back({testing::images_in(set / "laser_180717"), {}});
  CalibrationOptions options;
  const Eigen::Index count = camera.model.camera.parameters().size();
  ASSERT_TRUE(camera.model.covariance.has_value());
  options.known_camera =
      KnownCamera{camera.model.camera,
                  Eigen::MatrixXd(camera.model.covariance->matrix.topLeftCorner(count, count))};
  const Calibration c = calibrate(lasers, options);
  EXPECT_EQ(camera.model.camera, c.model.camera);
  EXPECT_EQ(StripeAxis::kRows, c.model.axis);
  EXPECT_EQ(Channel::kGreenMinusRed, c.settings.channel);
  EXPECT_EQ(Channel::kGreen, c.model.channel) << "where a scanner finds more";
  EXPECT_GE(c.observations.stripes.size(), 50U);

  std::vector<Eigen::Vector3d> reference;
  std::ifstream lines(set / "reference" / "laser_points.csv");
  for (double x, y, z; lines >> x >> y >> z;) reference.emplace_back(x, y, z);
  ASSERT_GT(reference.size(), 10000U);
  const LaserPlane expected = fit_plane(reference).value();
  const LaserPlane& found = c.model.lasers.at(0).plane;
  std::printf("plane %.3f degrees and %.2f mm from the reference's, points %.3f mm rms\n",
              angle_deg(found.normal(), expected.normal()),
              1e3 * (found.distance_m() - expected.distance_m()), 1e3 * return_rms_m(c));
  EXPECT_LT(angle_deg(found.normal(), expected.normal()), 0.15);
  EXPECT_NEAR(found.distance_m(), expected.distance_m(), 0.001);
  EXPECT_LE(return_rms_m(c), 0.00055);
  // The board of these images is bent, and the halves of them disagree: that is said here too.
  EXPECT_THAT(c.findings, Contains(Field(&Event::code, EventCode("board_bent"))));
  EXPECT_GT(c.validation.splits, 0);
}

// All of its images at once are another matter: the board was bent by 0.4 mm in the one set and
// by 0.75 mm in the other (corners found by OpenCV say the same), so that fx is 620 from the first,
// 616 from the second, 623 from the corners of both, and the stripes on the bent margin move it on
// to 624. The user is told so, and what to do: what the test above does.
TEST(RealLasers, SrvsBoardThatGivesWayIsSaidToMoveTheCamera) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("srv-green-laser-turntable");
  const auto set = testing::real_data("srv-green-laser-turntable");
  CalibrationInput input;
  input.board = parse_board("8x6", 0.040);
  input.boards = testing::images_in(set / "camera_180717");
  input.lasers.push_back({testing::images_in(set / "laser_180717"), {}});
  const Calibration c = calibrate(input, {});
  std::printf("camera and laser together: fx %.1f, bend %.2f mm; %s\n", c.model.camera.fx(),
              1e3 * c.solution.bend_m.y(), c.verdict().c_str());
  EXPECT_THAT(c.findings, Contains(Field(&Event::code, EventCode("stripes_move_camera"))));
  EXPECT_THAT(c.findings, Contains(Field(&Event::code, EventCode("board_bent"))));
  EXPECT_THAT(c.findings, Contains(Field(&Event::code, EventCode("halves_disagree"))));

  // Not for want of good corners: the bend of each set is in OpenCV's corners too.
  JointOptions bent;
  bent.solve_bend = true;
  const auto bend_mm = [&](const char* file) {
    return 1e3 * solve_joint(testing::corners_from_csv(set / file, input.board, 640, 480), bent)
                     .bend_m.y();
  };
  EXPECT_NEAR(bend_mm("opencv_corners_cam180717.csv"), -0.40, 0.1);
  EXPECT_NEAR(bend_mm("opencv_corners_laser180717.csv"), -0.78, 0.1);
}

TEST(RealLasers, BlasersRedLineClippedToWhiteKeepsItsCore) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("blaser-cmu");
  CalibrationInput input;
  input.board = parse_board("9x6", 0.030);
  input.lasers.push_back(
      {testing::images_in(testing::real_data("blaser-cmu") / "handheld_1280x720"), {}});
  const Calibration c = calibrate(input, {});
  EXPECT_EQ(StripeAxis::kColumns, c.model.axis);
  EXPECT_NE(Channel::kRedMinusGreen, c.model.channel);
  EXPECT_NE(Channel::kGreenMinusRed, c.model.channel);
  EXPECT_NE(Channel::kGreen, c.model.channel) << "as many stripes, half a pixel off their plane";
  ASSERT_GE(c.compared_settings.size(), 3U);
  EXPECT_GE(c.compared_settings.front().on_plane, 15);
  EXPECT_LE(c.compared_settings.front().rms_px, 0.45);
  EXPECT_GE(c.observations.stripes.size(), 15U);
  EXPECT_LE(return_rms_m(c), 0.0005);
  EXPECT_NEAR(c.depths_m.at(0).first, 0.16, 0.05);
  EXPECT_LT(angle_deg(c.model.lasers[0].plane.normal(),
                      Eigen::Vector3d(0.05262, 0.91128, 0.40842).normalized()),
            0.5);
  EXPECT_TRUE(c.trustworthy()) << c.verdict();
  // Wider the nearer.
  const StripeLook& look = c.model.lasers[0].look;
  ASSERT_GE(look.width_at.size(), 3U);
  EXPECT_GT(look.width_at.front().width_px, 1.2 * look.width_at.back().width_px);
  ASSERT_TRUE(look.colour.has_value());
  EXPECT_GT((*look.colour)[2], (*look.colour)[1]) << "red";
  for (const SettingsScore& score : c.compared_settings)
    std::printf("%s: %d of %d stripes on the plane, %.3f px rms\n",
                to_string(score.settings).c_str(), score.on_plane, score.stripes, score.rms_px);
  std::printf("plane rms %.3f mm over %.3f to %.3f m\n", 1e3 * return_rms_m(c), c.depths_m[0].first,
              c.depths_m[0].second);
}

TEST(RealLasers, ABentBoardIsTakenWithAWarning) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("b33-handheld-known-distance");
  CalibrationInput input;
  input.board = parse_board("9x7", 0.025);
  input.boards = testing::images_in(testing::real_data("b33-handheld-known-distance") / "cal_in");
  const Calibration c = calibrate(input, {});
  EXPECT_TRUE(c.trustworthy()) << c.verdict();
  EXPECT_EQ(Severity::kWarning, worst(c.findings));
  EXPECT_THAT(c.findings, Contains(Field(&Event::code, EventCode("board_bent"))));
}

}  // namespace
}  // namespace striper
