// SPDX-License-Identifier: Apache-2.0
// Proves on rendered boards that the stripe is found where the laser plane meets the board, on the
// squares and on the margin, in one picture or in a pair, along columns or rows; that its sigmas
// are those of its errors; that returns on albedo edges and off the board are left out; and that a
// picture without a stripe says so.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include <striper/core/error.hpp>
#include <striper/laser_plane/board_stripe.hpp>

#include "support/board_picture.hpp"
#include "support/striper_session.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using testing::SyntheticStriper;

constexpr StripeRecipe kPlain{StripeAxis::kColumns, Channel::kGrey, false};
constexpr StripeRecipe kSubtracted{StripeAxis::kColumns, Channel::kGrey, true};

// A striper of a quarter of the usual picture, so that rendering takes little time.
SyntheticStriper small_striper() {
  SyntheticStriper striper;
  striper.camera = CameraModel(480, 360, 460.0, 460.0, 239.5, 179.5, LensModel::kPlumbBob,
                               {-0.25, 0.10, 0.0, 0.0, 0.0});
  return striper;
}

LaserPicture picture_of(const SyntheticStriper& striper, const testing::BoardPose& pose,
                        bool with_off) {
  LaserPicture picture;
  picture.name = "picture";
  picture.T_cam_board = testing::T_cam_board(striper, pose);
  testing::BoardPictureOptions options;
  options.samples = 3;
  options.noise_dn = 2.0;
  options.white_dn = 120.0;
  options.laser_dn = 110.0;
  if (with_off)
    picture.off =
        testing::render_board(striper.camera, striper.board, picture.T_cam_board, options);
  options.laser = striper.plane;
  picture.on = testing::render_board(striper.camera, striper.board, picture.T_cam_board, options);
  return picture;
}

// Distances of the found points from the true stripe along their columns, over their sigmas.
struct Pulls {
  double rms_px = 0.0;
  double rms = 0.0;
  double mean = 0.0;
};

Pulls pulls_of(const SyntheticStriper& striper, const LaserPicture& picture,
               const BoardStripe& stripe) {
  Pulls pulls;
  const auto n = static_cast<double>(stripe.pixel.size());
  const Eigen::Isometry3d T_board_cam = picture.T_cam_board.inverse();
  const auto height_m = [&](const Eigen::Vector2d& pixel) {
    const auto ray = striper.camera.unproject(pixel);
    const Eigen::Vector3d r_cam(ray.xy.x(), ray.xy.y(), 1.0);
    const double along = -T_board_cam.translation().z() / (T_board_cam.linear() * r_cam).z();
    return striper.plane.signed_distance_m(along * r_cam);
  };
  for (std::size_t i = 0; i < stripe.pixel.size(); ++i) {
    const Eigen::Vector2d step(0.0, 0.5);
    const double slope = height_m(stripe.pixel[i] + step) - height_m(stripe.pixel[i] - step);
    const double e_px = height_m(stripe.pixel[i]) / slope;
    pulls.rms_px += e_px * e_px / n;
    pulls.rms += std::pow(e_px / stripe.sigma_px[i], 2.0) / n;
    pulls.mean += e_px / n;
  }
  pulls.rms_px = std::sqrt(pulls.rms_px);
  pulls.rms = std::sqrt(pulls.rms);
  return pulls;
}

constexpr testing::BoardPose kPose{240, 210, 1.3, 25, -15, 6};

TEST(FindBoardStripe, FindsItInOnePicture) {
  const SyntheticStriper striper = small_striper();
  const LaserPicture picture = picture_of(striper, kPose, false);
  const BoardStripe stripe = find_board_stripe(picture, striper.board, striper.camera, kPlain);
  ASSERT_TRUE(stripe.found()) << stripe.reason;
  EXPECT_GE(stripe.pixel.size(), 20U);
  EXPECT_LE(stripe.pixel.size(), 120U);
  EXPECT_GT(stripe.at_albedo_edge, 0);
  EXPECT_NEAR(stripe.width_px, 1.5, 0.3);
  const Pulls pulls = pulls_of(striper, picture, stripe);
  std::printf("one picture: rms %.3f px, mean %.3f px, pulls %.2f\n", pulls.rms_px, pulls.mean,
              pulls.rms);
  EXPECT_LT(pulls.rms_px, 0.06);
  EXPECT_NEAR(pulls.mean, 0.0, 0.02);
  EXPECT_LT(pulls.rms, 1.6);
}

TEST(FindBoardStripe, FindsItInAPair) {
  const SyntheticStriper striper = small_striper();
  const LaserPicture picture = picture_of(striper, kPose, true);
  const BoardStripe stripe = find_board_stripe(picture, striper.board, striper.camera, kSubtracted);
  ASSERT_TRUE(stripe.found()) << stripe.reason;
  const Pulls pulls = pulls_of(striper, picture, stripe);
  std::printf("pair: rms %.3f px, mean %.3f px, pulls %.2f\n", pulls.rms_px, pulls.mean, pulls.rms);
  EXPECT_LT(pulls.rms_px, 0.06);
  EXPECT_NEAR(pulls.mean, 0.0, 0.02);
  EXPECT_LT(pulls.rms, 1.6);
}

TEST(FindBoardStripe, IsNotMisledByABrighterLineBesideTheBoard) {
  const SyntheticStriper striper = small_striper();
  LaserPicture picture = picture_of(striper, {240, 210, 2.2, 25, -15, 6}, false);
  const cv::Mat mask = board_mask(striper.board, striper.camera, picture.T_cam_board, 3.0);
  cv::Mat line(picture.on.size(), CV_8UC1, cv::Scalar(0));
  cv::line(line, {0, 20}, {479, 40}, cv::Scalar(255), 3);
  picture.on.setTo(255, line & ~mask);
  const BoardStripe stripe = find_board_stripe(picture, striper.board, striper.camera, kPlain);
  ASSERT_TRUE(stripe.found()) << stripe.reason;
  EXPECT_LT(pulls_of(striper, picture, stripe).rms_px, 0.1);
}

TEST(FindBoardStripe, IsNotPulledByABlobOnTheLine) {
  const SyntheticStriper striper = small_striper();
  LaserPicture picture = picture_of(striper, kPose, false);
  const auto clean = find_board_stripe(picture, striper.board, striper.camera, kPlain);
  ASSERT_TRUE(clean.found()) << clean.reason;
  const Eigen::Vector2d at = clean.pixel[clean.pixel.size() / 2];
  cv::circle(picture.on, cv::Point(static_cast<int>(at.x()), static_cast<int>(at.y()) + 5), 7,
             cv::Scalar(255), cv::FILLED);
  const auto stripe = find_board_stripe(picture, striper.board, striper.camera, kPlain);
  ASSERT_TRUE(stripe.found()) << stripe.reason;
  EXPECT_LT(pulls_of(striper, picture, stripe).rms_px, 0.08);
}

TEST(FindBoardStripe, SaysThatThereIsNone) {
  const SyntheticStriper striper = small_striper();
  LaserPicture picture = picture_of(striper, kPose, true);
  picture.on = picture.off;
  picture.off = cv::Mat();
  const BoardStripe stripe = find_board_stripe(picture, striper.board, striper.camera, kPlain);
  EXPECT_FALSE(stripe.found());
  EXPECT_THAT(stripe.reason, HasSubstr("no straight stripe on the board"));
}

TEST(ChooseRecipe, TakesThePairAndTheAxis) {
  const SyntheticStriper striper = small_striper();
  const std::vector<LaserPicture> pictures = {
      picture_of(striper, kPose, true), picture_of(striper, {230, 200, 1.4, -25, 15, -6}, true)};
  const StripeRecipe recipe =
      choose_recipe(pictures, striper.board, striper.camera, std::nullopt, Channel::kAuto);
  EXPECT_EQ(kSubtracted, recipe) << to_string(recipe);
}

TEST(ChooseRecipe, RefusesPicturesWithoutALaser) {
  const SyntheticStriper striper = small_striper();
  LaserPicture picture = picture_of(striper, kPose, true);
  picture.on = picture.off;
  picture.off = cv::Mat();
  EXPECT_THROW(
      choose_recipe({picture}, striper.board, striper.camera, std::nullopt, Channel::kAuto), Error);
}

TEST(BoardMask, CoversTheBoardAndNoMoreThanItsMargin) {
  const SyntheticStriper striper = small_striper();
  const auto T = testing::T_cam_board(striper, {240, 180, 2.0, 0, 0, 0});
  const cv::Mat mask = board_mask(striper.board, striper.camera, T, 1.0);
  // 8 + 2 + 2 squares by 5 + 2 + 2 of 60 mm at 2 m and 460 px.
  const double square_px = 0.06 * 460.0 / 2.0;
  EXPECT_NEAR(cv::countNonZero(mask), 12.0 * 9.0 * square_px * square_px, 700.0);
  EXPECT_EQ(255, mask.at<std::uint8_t>(180, 240));
  EXPECT_EQ(0, mask.at<std::uint8_t>(5, 5));
}

}  // namespace
}  // namespace striper
