// SPDX-License-Identifier: Apache-2.0
// Proves on rendered boards that the stripe is found where the laser plane meets the board, on the
// squares and on the margin, in one image or in a pair, along columns or rows; that its sigmas
// are those of its errors; that the width of a clipped one is learnt; that returns on albedo edges
// and off the board are left out; and that an image without a stripe says so.
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

constexpr ExtractionSettings kPlain{StripeAxis::kColumns, Channel::kGrey, false};
constexpr NoiseModel kNoise{2.0, 0.0, 0.0, 8};  // Of these images.
constexpr ExtractionSettings kSubtracted{StripeAxis::kColumns, Channel::kGrey, true};

// A striper of a quarter of the usual image, so that rendering takes little time. Its stripe runs
// across the image (kColumns), or down it: then the laser is to the right of the camera.
SyntheticStriper small_striper(StripeAxis axis = StripeAxis::kColumns) {
  SyntheticStriper striper;
  striper.camera = CameraModel(480, 360, 460.0, 460.0, 239.5, 179.5, LensModel::kPlumbBob,
                               {-0.25, 0.10, 0.0, 0.0, 0.0});
  const Eigen::Vector3d n = striper.plane.normal();
  if (axis == StripeAxis::kRows)
    striper.plane = {Eigen::Vector3d(n.y(), n.x(), n.z()), striper.plane.distance_m()};
  return striper;
}

// The light of a board image, as these tests have it.
testing::BoardImageOptions lit_board(StripeAxis axis = StripeAxis::kColumns) {
  testing::BoardImageOptions options;
  options.samples = 3;
  options.noise_dn = 2.0;
  options.white_dn = 120.0;
  options.laser_dn = 110.0;
  options.laser_axis = axis;
  return options;
}

LaserImage image_of(const SyntheticStriper& striper, const testing::BoardPose& pose, bool with_off,
                    testing::BoardImageOptions options = lit_board()) {
  LaserImage image;
  image.name = "image";
  image.T_cam_board = testing::T_cam_board(striper, pose);
  if (with_off)
    image.off = testing::render_board(striper.camera, striper.board, image.T_cam_board, options);
  options.laser = striper.plane;
  image.on = testing::render_board(striper.camera, striper.board, image.T_cam_board, options);
  return image;
}

// Distances of the found points from the true stripe along their profiles, over their sigmas.
struct Pulls {
  double rms_px = 0.0;
  double rms = 0.0;
  double mean_px = 0.0;
};

Pulls pulls_of(const SyntheticStriper& striper, const LaserImage& image, const BoardStripe& stripe,
               StripeAxis axis) {
  Pulls pulls;
  const auto n = static_cast<double>(stripe.pixel.size());
  const Eigen::Isometry3d T_board_cam = image.T_cam_board.inverse();
  const auto height_m = [&](const Eigen::Vector2d& pixel) {
    const auto ray = striper.camera.unproject(pixel);
    const Eigen::Vector3d r_cam(ray.xy.x(), ray.xy.y(), 1.0);
    const double along = -T_board_cam.translation().z() / (T_board_cam.linear() * r_cam).z();
    return striper.plane.signed_distance_m(along * r_cam);
  };
  const Eigen::Vector2d half = testing::half_pixel_across(axis);
  for (std::size_t i = 0; i < stripe.pixel.size(); ++i) {
    const double slope = height_m(stripe.pixel[i] + half) - height_m(stripe.pixel[i] - half);
    const double e_px = height_m(stripe.pixel[i]) / slope;
    pulls.rms_px += e_px * e_px / n;
    pulls.rms += std::pow(e_px / stripe.sigma_px[i], 2.0) / n;
    pulls.mean_px += e_px / n;
  }
  pulls.rms_px = std::sqrt(pulls.rms_px);
  pulls.rms = std::sqrt(pulls.rms);
  return pulls;
}

// What is found in an image, and how it compares with the truth.
struct Found {
  BoardStripe stripe;
  Pulls pulls;
};

Found found_in(const SyntheticStriper& striper, const LaserImage& image,
               const ExtractionSettings& settings,
               const std::optional<NoiseModel>& noise = std::nullopt) {
  Found found;
  found.stripe = find_board_stripe(image, striper.board, striper.camera, settings, noise);
  EXPECT_TRUE(found.stripe.found()) << found.stripe.reason;
  found.pulls = pulls_of(striper, image, found.stripe, settings.axis);
  std::printf("%s: %zu points, rms %.3f px, mean %.3f px, pulls %.2f, width %.2f px\n",
              to_string(settings).c_str(), found.stripe.pixel.size(), found.pulls.rms_px,
              found.pulls.mean_px, found.pulls.rms, found.stripe.width_px);
  return found;
}

constexpr testing::BoardPose kPose{240, 210, 1.3, 25, -15, 6};
constexpr testing::BoardPose kRowsPose{280, 180, 1.3, 15, -25, 6};

class FindBoardStripeBySettings : public ::testing::TestWithParam<ExtractionSettings> {};

TEST_P(FindBoardStripeBySettings, PutsItWhereLaserAndBoardMeet) {
  const ExtractionSettings settings = GetParam();
  const SyntheticStriper striper = small_striper(settings.axis);
  const auto& pose = settings.axis == StripeAxis::kColumns ? kPose : kRowsPose;
  const LaserImage image = image_of(striper, pose, settings.subtract_off, lit_board(settings.axis));
  const auto [stripe, pulls] = found_in(striper, image, settings, kNoise);
  EXPECT_GE(stripe.pixel.size(), 20U);
  EXPECT_LE(stripe.pixel.size(), 120U);
  EXPECT_GT(stripe.at_albedo_edge, 0);
  EXPECT_NEAR(stripe.width_px, 1.5, 0.3);
  EXPECT_LT(pulls.rms_px, 0.06);
  EXPECT_NEAR(pulls.mean_px, 0.0, 0.02);
  // The rms of 30 pulls scatters by 0.13.
  EXPECT_GT(pulls.rms, 0.6);
  EXPECT_LT(pulls.rms, 1.4);
}

INSTANTIATE_TEST_SUITE_P(
    AxesAndPairs, FindBoardStripeBySettings,
    ::testing::Values(kPlain, kSubtracted,
                      ExtractionSettings{StripeAxis::kRows, Channel::kGrey, false},
                      ExtractionSettings{StripeAxis::kRows, Channel::kGrey, true}),
    [](const auto& instance) {
      return std::string(instance.param.axis == StripeAxis::kColumns ? "Columns" : "Rows") +
             (instance.param.subtract_off ? "InAPair" : "InOneImage");
    });

// Noise that has to be measured on one image of a board comes out too large by up to two thirds:
// its squares are nearly everywhere. The adjustment takes such a factor off again.
TEST(FindBoardStripe, OfUnknownNoiseHasErrorBarsOnTheSafeSide) {
  const SyntheticStriper striper = small_striper(StripeAxis::kRows);
  const LaserImage image = image_of(striper, kRowsPose, false, lit_board(StripeAxis::kRows));
  const Pulls pulls = found_in(striper, image, {StripeAxis::kRows, Channel::kGrey, false}).pulls;
  EXPECT_GT(pulls.rms, 0.5);
  EXPECT_LT(pulls.rms, 1.4);
}

// The print above the stripe, which lies on two squares of white paper below it.
LaserImage margin_image(const SyntheticStriper& striper, double laser_dn, double tilt_deg) {
  const testing::BoardPose kStripeBelowPrint{240, 185, 1.0, tilt_deg, 0, 0};
  testing::BoardImageOptions options = lit_board();
  options.margin_squares = 2.0;
  options.laser_dn = laser_dn;
  return image_of(striper, kStripeBelowPrint, false, options);
}

constexpr double kSquare_deg = -14.0;  // To the laser plane, which is tilted as the camera is.
constexpr double kSloping_deg = 20.0;

TEST(FindBoardStripe, FindsItOnTheWhiteMargin) {
  const SyntheticStriper striper = small_striper();
  const auto [stripe, pulls] =
      found_in(striper, margin_image(striper, 110.0, kSloping_deg), kPlain);
  EXPECT_GE(stripe.pixel.size(), 60U);
  EXPECT_NEAR(stripe.width_px, 1.5, 0.1);
  EXPECT_LT(pulls.rms_px, 0.03);
  EXPECT_NEAR(pulls.mean_px, 0.0, 0.01);
  EXPECT_GT(pulls.rms, 0.5);
  EXPECT_LT(pulls.rms, 1.6);
}

TEST(FindBoardStripe, LearnsTheWidthOfAClippedOneByItsStraightness) {
  const SyntheticStriper striper = small_striper();
  const auto [stripe, pulls] = found_in(striper, margin_image(striper, 600.0, kSquare_deg), kPlain);
  EXPECT_NEAR(stripe.width_px, 1.5, 0.1);
  EXPECT_LT(pulls.rms_px, 0.03);
  EXPECT_NEAR(pulls.mean_px, 0.0, 0.005);
}

// Perspective on a slope skews the profile (adjust/cost_functions/stripe_skew.hpp), its flanks
// most, and of a clipped one hardly more than those is fitted.
TEST(FindBoardStripe, SlopeShiftsAClippedOneSeveralTimesAsMuch) {
  const SyntheticStriper striper = small_striper();
  const auto shift_px = [&](double laser_dn) {
    const LaserImage image = margin_image(striper, laser_dn, kSloping_deg);
    return found_in(striper, image, kPlain).pulls.mean_px;
  };
  const double whole_px = shift_px(110.0);
  const double clipped_px = shift_px(600.0);
  EXPECT_GT(clipped_px, 1.5 * whole_px);
  EXPECT_NEAR(clipped_px, 0.0, 0.02);
}

TEST(FindBoardStripe, IsNotMisledByABrighterLineBesideTheBoard) {
  const SyntheticStriper striper = small_striper();
  LaserImage image = image_of(striper, {240, 210, 2.2, 25, -15, 6}, false);
  const cv::Mat mask = board_mask(striper.board, striper.camera, image.T_cam_board, 3.0);
  cv::Mat line(image.on.size(), CV_8UC1, cv::Scalar(0));
  cv::line(line, {0, 20}, {479, 40}, cv::Scalar(255), 3);
  image.on.setTo(255, line & ~mask);
  EXPECT_LT(found_in(striper, image, kPlain).pulls.rms_px, 0.1);
}

TEST(FindBoardStripe, IsNotPulledByABlobOnTheLine) {
  const SyntheticStriper striper = small_striper();
  LaserImage image = image_of(striper, kPose, false);
  const BoardStripe clean = found_in(striper, image, kPlain).stripe;
  const Eigen::Vector2d at = clean.pixel.at(clean.pixel.size() / 2);
  cv::circle(image.on, cv::Point(static_cast<int>(at.x()), static_cast<int>(at.y()) + 5), 7,
             cv::Scalar(255), cv::FILLED);
  EXPECT_LT(found_in(striper, image, kPlain).pulls.rms_px, 0.08);
}

TEST(FindBoardStripe, SaysThatThereIsNone) {
  const SyntheticStriper striper = small_striper();
  LaserImage image = image_of(striper, kPose, true);
  image.on = image.off;
  image.off = cv::Mat();
  const BoardStripe stripe = find_board_stripe(image, striper.board, striper.camera, kPlain);
  EXPECT_FALSE(stripe.found());
  EXPECT_THAT(stripe.reason, HasSubstr("no straight stripe on the board"));
}

TEST(RankSettings, TakesThePairAndTheAxis) {
  const SyntheticStriper striper = small_striper();
  const std::vector<LaserImage> images = {image_of(striper, kPose, true),
                                          image_of(striper, {230, 200, 1.4, -25, 15, -6}, true)};
  const ExtractionSettings settings =
      rank_settings(images, striper.board, striper.camera, std::nullopt, Channel::kAuto)
          .plausible.front();
  EXPECT_EQ(kSubtracted, settings) << to_string(settings);
}

TEST(RankSettings, RefusesImagesWithoutALaser) {
  const SyntheticStriper striper = small_striper();
  LaserImage image = image_of(striper, kPose, true);
  image.on = image.off;
  image.off = cv::Mat();
  EXPECT_THROW(rank_settings({image}, striper.board, striper.camera, std::nullopt, Channel::kAuto),
               Error);
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
