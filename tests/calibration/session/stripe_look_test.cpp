// SPDX-License-Identifier: Apache-2.0
// Proves that a calibration tells what the stripe looks like as it was rendered (its width, its
// brightness over the cosine of incidence, its colour, also where its core is clipped to white),
// and that the way of reading it is chosen by the planes of all images, not by how crisp a
// stripe looks. Does not prove that real paper scatters light as Lambert has it.
#include <gmock/gmock.h>
#include <opencv2/core.hpp>

#include <striper/geometry/triangulator.hpp>
#include <striper/session/calibrate.hpp>

#include "small_session.hpp"

namespace striper {
namespace {

using testing::render_session;
using testing::session_options;
using testing::small_striper;
using testing::SyntheticStriper;

// The images in colour: the ground grey, what the laser adds divided among the channels.
std::vector<SessionImage> in_colour(const SyntheticStriper& striper, const std::string& name,
                                    testing::BoardImageOptions options,
                                    const std::array<double, 3>& shares) {
  std::vector<std::vector<SessionImage>> channels;
  const double laser_dn = options.laser_dn;
  for (const double share : shares) {
    options.laser_dn = share * laser_dn;
    channels.push_back(render_session(striper, name, options));
  }
  std::vector<SessionImage> images;
  for (std::size_t i = 0; i < channels[0].size(); ++i) {
    cv::Mat colour;
    cv::merge(
        std::vector<cv::Mat>{channels[0][i].image, channels[1][i].image, channels[2][i].image},
        colour);
    images.emplace_back(channels[0][i].name, colour);
  }
  return images;
}

CalibrationInput session_of(const SyntheticStriper& striper, std::vector<SessionImage> lit) {
  CalibrationInput input;
  input.board = striper.board;
  input.lasers.push_back({std::move(lit), {}});
  return input;
}

void print(const Calibration& c) {
  for (const SettingsScore& score : c.compared_settings)
    std::printf("%s: %d stripes, %d on the plane, %.3f px rms\n", to_string(score.settings).c_str(),
                score.stripes, score.on_plane, score.rms_px);
}

TEST(StripeLook, HasTheWidthThatWasRendered) {
  const SyntheticStriper striper = small_striper();
  for (const double width_px : {1.0, 1.8}) {
    testing::BoardImageOptions options = session_options(striper.plane);
    options.laser_width_px = width_px;
    const Calibration c = calibrate(session_of(striper, render_session(striper, "", options)), {});
    const StripeLook& look = c.model.lasers.at(0).look;
    ASSERT_TRUE(look.width_px.has_value());
    EXPECT_NEAR(*look.width_px, width_px, 0.06 * width_px);
    ASSERT_GE(look.width_at.size(), 3U);
    for (const auto& at : look.width_at) EXPECT_NEAR(at.width_px, width_px, 0.12 * width_px);
    EXPECT_NEAR(look.width_at.front().range_m, c.depths_m.at(0).first, 0.02);
    EXPECT_NEAR(look.width_at.back().range_m, c.depths_m.at(0).second, 0.02);
    EXPECT_FALSE(look.colour.has_value()) << "grey images tell no colour";
    c.model.validate();
  }
}

// The renderer's stripe is as bright on a tilted board as on one that faces the laser, so that the
// amplitude on facing paper comes out larger by the cosine, which the poses keep above .7.
TEST(StripeLook, HasTheAmplitudeOverTheCosineOfIncidence) {
  const SyntheticStriper striper = small_striper();
  const Calibration c =
      calibrate(session_of(striper, render_session(striper, "", striper.plane)), {});
  const StripeLook& look = c.model.lasers.at(0).look;
  ASSERT_GE(look.amplitude_at.size(), 3U);
  const double white_dn = session_options(striper.plane).laser_dn;
  for (const auto& at : look.amplitude_at) {
    EXPECT_GT(at.amplitude_dn, 0.97 * white_dn);
    EXPECT_LT(at.amplitude_dn, 1.5 * white_dn);
  }
}

TEST(StripeLook, HasTheColourOfTheLight) {
  const SyntheticStriper striper = small_striper();
  testing::BoardImageOptions options = session_options(striper.plane);
  for (const double laser_dn : {150.0, 420.0}) {  // The second is clipped in two channels.
    options.laser_dn = laser_dn;
    const std::array<double, 3> shares{0.1, 0.3, 0.6};
    const Calibration c =
        calibrate(session_of(striper, in_colour(striper, "", options, shares)), {});
    const auto& colour = c.model.lasers.at(0).look.colour;
    ASSERT_TRUE(colour.has_value());
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR((*colour)[i], shares[i], 0.04) << laser_dn;
  }
}

TEST(StripeLook, LeavesTheAmplitudeOfAClippedStripeOut) {
  const SyntheticStriper striper = small_striper();
  testing::BoardImageOptions options = session_options(striper.plane);
  options.laser_dn = 300.0;
  const Calibration c = calibrate(session_of(striper, render_session(striper, "", options)), {});
  const StripeLook& look = c.model.lasers.at(0).look;
  EXPECT_TRUE(look.amplitude_at.empty());
  ASSERT_TRUE(look.width_px.has_value());
  EXPECT_NEAR(*look.width_px, options.laser_width_px, 0.15 * options.laser_width_px);
}

// In green the stripe is crisp and bright, but it lies on another plane in every image, as a
// reflection does; in red it is faint and noisy and is the laser's.
TEST(ChosenSettings, IsTheOneWhoseStripesLieOnAPlane) {
  const SyntheticStriper striper = small_striper();
  testing::BoardImageOptions red = session_options(striper.plane);
  red.noise_dn = 2.5;
  red.laser_dn = 100.0;
  const auto red_images = render_session(striper, "", red);
  std::vector<SessionImage> images;
  const auto poses = testing::session_poses(striper);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double tilt = 0.02 * static_cast<double>(i % 4);
    testing::BoardImageOptions green = session_options(
        LaserPlane((striper.plane.normal() + Eigen::Vector3d(tilt, 0.0, -tilt)).normalized(),
                   striper.plane.distance_m()));
    green.noise_dn = 0.5;
    const cv::Mat green_image =
        testing::render_board(striper.camera, striper.board, poses[i], green);
    const cv::Mat blue_image = testing::render_board(striper.camera, striper.board, poses[i],
                                                     session_options(std::nullopt));
    cv::Mat colour;
    cv::merge(std::vector<cv::Mat>{blue_image, green_image, red_images[i].image}, colour);
    images.emplace_back("colour " + std::to_string(i), colour);
  }
  const Calibration c = calibrate(session_of(striper, images), {});
  print(c);
  EXPECT_THAT(c.model.channel, ::testing::AnyOf(Channel::kRed, Channel::kRedMinusGreen));
  EXPECT_EQ(c.model.axis, StripeAxis::kColumns);
  ASSERT_GE(c.compared_settings.size(), 2U);
  EXPECT_EQ(c.compared_settings.front().settings, c.settings);
  EXPECT_GE(c.compared_settings.front().on_plane, 6);
  for (std::size_t i = 1; i < c.compared_settings.size(); ++i)
    EXPECT_LT(c.compared_settings[i].on_plane / c.compared_settings[i].rms_px,
              c.compared_settings.front().on_plane / c.compared_settings.front().rms_px);
  EXPECT_TRUE(c.trustworthy()) << c.verdict();
}

// In green the ground is uneven, the same with the laser on and off: subtracted it is gone, and the
// laser is brightest in green; single frames show it best in red.
TEST(ChosenSettings, OfPairsKeepsTheChannelForSingleFramesApart) {
  const SyntheticStriper striper = small_striper();
  testing::BoardImageOptions options = session_options(striper.plane);
  const auto lit = in_colour(striper, "", options, {0.05, 0.6, 0.35});
  options.laser_dn = 0.0;
  const auto unlit = in_colour(striper, "", options, {0.05, 0.6, 0.35});
  CalibrationInput input;
  input.board = striper.board;
  LaserImages& laser = input.lasers.emplace_back();
  cv::RNG random(1991);
  for (std::size_t i = 0; i < lit.size(); ++i) {
    cv::Mat ground(lit[i].image.size(), CV_8UC1);
    random.fill(ground, cv::RNG::NORMAL, 40.0, 12.0);
    const cv::Mat nothing = cv::Mat::zeros(ground.size(), ground.type());
    cv::Mat uneven;
    cv::merge(std::vector<cv::Mat>{nothing, ground, nothing}, uneven);
    laser.on.emplace_back("on " + std::to_string(i), cv::Mat(lit[i].image + uneven));
    laser.off.emplace_back("off " + std::to_string(i), cv::Mat(unlit[i].image + uneven));
  }
  const Calibration c = calibrate(input, {});
  print(c);
  EXPECT_EQ(c.model.channel, Channel::kRed);
  ASSERT_TRUE(c.model.difference_channel.has_value());
  EXPECT_THAT(*c.model.difference_channel, ::testing::AnyOf(Channel::kGreen, Channel::kGrey));
  EXPECT_GE(c.observations.stripes.size(), 7U);
  EXPECT_TRUE(c.trustworthy()) << c.verdict();
}

}  // namespace
}  // namespace striper
