// SPDX-License-Identifier: Apache-2.0
// Proves that a survey finds along which axis and in which channel images show a stripe, with and
// without dark exposures, and that it says of plain noise that there is none. Does not prove that a
// textured scene has none: that is the extractor's business.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/pipeline/stripe_survey.hpp>

#include "support/error_of.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

// A noisy stripe from left to right.
cv::Mat stripe_along_columns(double amplitude_dn = 100.0) {
  testing::SyntheticStripe stripe;
  stripe.lines = 160;
  stripe.length = 120;
  stripe.position = [](int line) { return 50.0 + 0.1 * line; };
  stripe.amplitude_dn = amplitude_dn;
  stripe.background_dn = 20.0;
  stripe.noise_dn = 1.5;
  return testing::render(stripe).lit;
}

Frame frame_of(const cv::Mat& image, std::uint64_t sequence = 0) {
  Frame frame;
  frame.image = image;
  frame.sensor_size = image.size();
  frame.sequence = sequence;
  return frame;
}

// A stripe in one colour, noise in the others.
Frame coloured(int channel, bool is_along_rows) {
  std::vector<cv::Mat> planes;
  for (int c = 0; c < 3; ++c) planes.push_back(stripe_along_columns(c == channel ? 100.0 : 0.0));
  cv::Mat image;
  cv::merge(planes, image);
  return frame_of(is_along_rows ? cv::Mat(image.t()) : image);
}

TEST(SurveyStripes, FindsTheAxisOfAGreyImage) {
  for (const bool is_along_rows : {false, true}) {
    const cv::Mat image = stripe_along_columns();
    const std::vector<Frame> frames{frame_of(is_along_rows ? cv::Mat(image.t()) : image)};
    const auto sightings = survey_stripes(frames, {});
    ASSERT_EQ(sightings.size(), 2U) << "a grey image has one channel";
    EXPECT_TRUE(sightings[0].is_seen());
    EXPECT_EQ(sightings[0].axis, is_along_rows ? StripeAxis::kRows : StripeAxis::kColumns);
    EXPECT_EQ(sightings[0].channel, Channel::kGrey);
    EXPECT_GT(sightings[0].found, 0.9);
    EXPECT_EQ(sightings[0].scans, 1U);
    EXPECT_FALSE(sightings[1].is_seen());
  }
}

TEST(SurveyStripes, FindsTheColour) {
  constexpr std::array kPlanes{Channel::kBlue, Channel::kGreen, Channel::kRed};
  for (int plane = 0; plane < 3; ++plane) {
    const std::vector<Frame> frames{coloured(plane, plane == 2)};
    const auto sightings = survey_stripes(frames, {});
    ASSERT_EQ(sightings.size(), 12U);
    EXPECT_TRUE(sightings[0].is_seen());
    EXPECT_EQ(sightings[0].channel, kPlanes[static_cast<std::size_t>(plane)]);
    EXPECT_EQ(sightings[0].axis, plane == 2 ? StripeAxis::kRows : StripeAxis::kColumns);
  }
}

TEST(SurveyStripes, SubtractsDarkExposures) {
  ScannerOptions options;
  options.ambient.pattern = IlluminationPattern::parse("dark,0");
  std::vector<Frame> frames;
  for (std::uint64_t n = 0; n < 3; ++n) {
    frames.push_back(frame_of(stripe_along_columns(n % 2 == 1 ? 100.0 : 0.0), n));
  }
  const auto sightings = survey_stripes(frames, options);
  EXPECT_EQ(sightings[0].scans, 1U) << "two are dark";
  EXPECT_TRUE(sightings[0].is_seen());
}

TEST(SurveyStripes, LooksWithoutWhatTheModelExpects) {
  ScannerOptions options;
  options.stripe.axis = StripeAxis::kRows;
  ExpectedStripe elsewhere;
  options.stripe.expected.push_back(elsewhere);
  const std::vector<Frame> frames{frame_of(stripe_along_columns())};
  const auto sightings = survey_stripes(frames, options);
  EXPECT_EQ(sightings[0].axis, StripeAxis::kColumns);
  EXPECT_TRUE(sightings[0].is_seen());
}

TEST(SurveyStripes, SaysOfNoiseThatThereIsNone) {
  const std::vector<Frame> frames{frame_of(stripe_along_columns(0.0)),
                                  frame_of(stripe_along_columns(0.0), 1)};
  const auto sightings = survey_stripes(frames, {});
  ASSERT_EQ(sightings.size(), 2U);
  for (const StripeSighting& one : sightings) {
    EXPECT_EQ(one.scans, 2U);
    EXPECT_FALSE(one.is_seen());
  }
}

TEST(SurveyStripes, OfNothingOrBadFramesIsNothing) {
  EXPECT_TRUE(survey_stripes({}, {}).empty());
  Frame bad = frame_of(stripe_along_columns());
  bad.status = FrameStatus::kCorrupt;
  const std::vector<Frame> frames{bad};
  for (const StripeSighting& one : survey_stripes(frames, {})) {
    EXPECT_EQ(one.scans, 0U);
    EXPECT_FALSE(one.is_seen());
  }
}

TEST(SurveyStripes, RefusesWrongOptions) {
  ScannerOptions options;
  options.stripe.min_confidence = 2.0;
  const std::vector<Frame> frames{frame_of(stripe_along_columns())};
  EXPECT_EQ(testing::error_of([&] { survey_stripes(frames, options); }).kind(),
            ErrorKind::kBadValue);
}

}  // namespace
}  // namespace striper
