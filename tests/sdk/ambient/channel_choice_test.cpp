// SPDX-License-Identifier: Apache-2.0
// Proves which channel of a colour image is searched: synthetic traps, then the two real ones (a
// stripe clipped to white on one set, a white board that is almost as bright as the stripe on the
// other), and that a difference shows a clipped stripe where its own colour does.
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <striper/ambient/channel_choice.hpp>
#include <striper/stripe/extractor.hpp>

#include "ambient/pixels/colour_difference.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using detail::ColourDifference;

cv::Mat scene(const cv::Scalar& background, const cv::Scalar& line) {
  cv::Mat image(120, 160, CV_8UC3, background);
  cv::line(image, {0, 60}, {159, 70}, line, 3);
  cv::Mat noise(image.size(), CV_8UC3);
  cv::RNG random(5);
  random.fill(noise, cv::RNG::UNIFORM, 0, 8);
  return image + noise;
}

TEST(ChooseChannel, GreyImageIsGrey) {
  EXPECT_EQ(choose_channel(cv::Mat::zeros(40, 40, CV_8UC1), StripeAxis::kColumns), Channel::kGrey);
}

TEST(ChooseChannel, DimRedLineIsSearchedInRed) {
  const Channel channel = choose_channel(scene({40, 40, 40}, {40, 40, 65}), StripeAxis::kColumns);
  EXPECT_TRUE(channel == Channel::kRed || channel == Channel::kRedMinusGreen) << to_string(channel);
}

TEST(ChooseChannel, GreenLineOnAWhiteSheetNeedsTheDifference) {
  cv::Mat image = scene({40, 40, 40}, {40, 40, 40});
  image(cv::Rect(0, 40, 160, 45)).setTo(cv::Scalar(230, 230, 230));
  cv::line(image, {0, 60}, {159, 70}, {180, 255, 180}, 3);
  EXPECT_EQ(choose_channel(image, StripeAxis::kColumns), Channel::kGreenMinusRed);
}

TEST(SelectChannel, GreyImageIsNotCopied) {
  const cv::Mat image(4, 4, CV_16UC1, cv::Scalar(7));
  ChannelImages channel;
  select_channel(image, Channel::kGreenMinusRed, channel);
  EXPECT_EQ(channel.lit.data, image.data);
  EXPECT_TRUE(channel.dark.empty());
}

TEST(SelectChannel, DifferenceKeepsBothChannelsApart) {
  const cv::Mat image(4, 4, CV_8UC3, cv::Scalar(10, 200, 50));
  ChannelImages channel;
  select_channel(image, Channel::kGreenMinusRed, channel);
  EXPECT_EQ(channel.lit.at<std::uint8_t>(1, 1), 200);
  EXPECT_EQ(channel.dark.at<std::uint8_t>(1, 1), 50);
  select_channel(image, Channel::kBlue, channel);
  EXPECT_EQ(channel.lit.at<std::uint8_t>(1, 1), 10);
  EXPECT_TRUE(channel.dark.empty());
}

TEST(SelectChannel, NeverWritesIntoAnImageItHandedThrough) {
  const cv::Mat grey(4, 4, CV_8UC1, cv::Scalar(7));
  ChannelImages channel;
  select_channel(grey, Channel::kGrey, channel);
  select_channel(cv::Mat(4, 4, CV_8UC3, cv::Scalar(1, 2, 3)), Channel::kRed, channel);
  EXPECT_EQ(grey.at<std::uint8_t>(0, 0), 7);
}

TEST(ChooseChannel, GreenLineOnAlmostWhiteRealBoardIsADifference) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("srv-green-laser-turntable");
  int right = 0;
  int all = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           testing::real_data("srv-green-laser-turntable") / "laser_180717")) {
    ++all;
    right += choose_channel(cv::imread(entry.path().string()), StripeAxis::kRows) ==
                     Channel::kGreenMinusRed
                 ? 1
                 : 0;
  }
  EXPECT_GE(right, all * 9 / 10) << "of " << all;
}

TEST(ChooseChannel, RealRedLineClippedToWhiteKeepsItsCore) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("blaser-cmu");
  int hollow = 0;
  int all = 0;
  for (const auto& entry : std::filesystem::directory_iterator(testing::real_data("blaser-cmu") /
                                                               "handheld_1280x720")) {
    const cv::Mat image = cv::imread(entry.path().string());
    if (image.empty()) continue;
    ++all;
    hollow += choose_channel(image, StripeAxis::kColumns) == Channel::kRedMinusGreen ? 1 : 0;
  }
  EXPECT_EQ(hollow, 0) << "of " << all;
}

// Where green - red places the stripe of the same rows that green alone shows. Before it was
// corrected, 15 % of the rows were 4 px beside it, on a flank.
TEST(ColourDifference, PlacesARealLineClippedToWhiteWhereItsOwnColourDoes) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("srv-green-laser-turntable");
  const auto extractor_of_rows = [] {
    ExtractOptions options;
    options.axis = StripeAxis::kRows;
    options.each_line_by_itself = true;  // Where it is, not whether it is the stripe.
    return make_extractor(options);
  };
  const auto of_green = extractor_of_rows();
  const auto of_difference = extractor_of_rows();
  ColourDifference difference;
  int rows = 0;
  int beside = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           testing::real_data("srv-green-laser-turntable") / "turntable_180717_subset")) {
    const cv::Mat image = cv::imread(entry.path().string());
    if (image.empty()) continue;
    const auto frame_of = [&](Channel channel) {
      ChannelImages images;
      select_channel(image, channel, images);
      LitFrame frame;
      frame.lit = images.lit;
      frame.dark = images.dark;
      frame.is_dark_a_channel = !images.dark.empty();
      frame.full_scale_dn = 255;
      return frame;
    };
    Stripe green;
    of_green->extract(frame_of(Channel::kGreen), green);
    LitFrame corrected = frame_of(Channel::kGreenMinusRed);
    difference.correct(corrected, StripeAxis::kRows);
    Stripe stripe;
    of_difference->extract(corrected, stripe);
    for (std::size_t i = 0; i < green.size(); ++i) {
      if (green.status[i] != ReturnStatus::kOk || stripe.status[i] != ReturnStatus::kOk) continue;
      ++rows;
      beside += std::abs(stripe.across_px[i] - green.across_px[i]) > 4.0 ? 1 : 0;
    }
  }
  EXPECT_GT(rows, 13000);
  EXPECT_LE(beside, rows * 6 / 100) << "of " << rows;
}

}  // namespace
}  // namespace striper
