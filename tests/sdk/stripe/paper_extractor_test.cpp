// SPDX-License-Identifier: Apache-2.0
// Proves that the method `paper` is the paper's: the brightest pixel above a threshold, then the
// weighted mean of three; that every scan line says why it has no return; that axes, depths, grids
// and dark images are handled. It does not prove that the method is accurate: it is not (pixel
// locking, background).
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/error_of.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

using testing::SyntheticStripe;

Stripe extract(const LitFrame& frame, std::optional<double> threshold_dn = std::nullopt,
               StripeAxis axis = StripeAxis::kColumns) {
  ExtractOptions options;
  options.method = ExtractMethod::kPaper;
  options.threshold_dn = threshold_dn;
  options.axis = axis;
  Stripe stripe;
  make_extractor(options)->extract(frame, stripe);
  return stripe;
}

LitFrame one_column(const std::vector<int>& pixels) {
  LitFrame frame;
  frame.full_scale_dn = 255;
  frame.lit = cv::Mat(static_cast<int>(pixels.size()), 1, CV_8UC1);
  for (std::size_t v = 0; v < pixels.size(); ++v) {
    frame.lit.at<std::uint8_t>(static_cast<int>(v), 0) = static_cast<std::uint8_t>(pixels[v]);
  }
  return frame;
}

TEST(PaperExtractor, PositionIsTheWeightedMeanOfThreePixels) {
  const Stripe stripe = extract(one_column({0, 0, 0, 0, 0, 20, 100, 60, 0, 0, 0, 0, 0, 0}), 10.0);
  ASSERT_EQ(stripe.status[0], ReturnStatus::kOk);
  EXPECT_DOUBLE_EQ(stripe.across_px[0], 6.0 + (60.0 - 20.0) / (20.0 + 100.0 + 60.0));
  EXPECT_FLOAT_EQ(stripe.sigma_px[0], static_cast<float>(1.0 / std::sqrt(12.0)));
  EXPECT_FLOAT_EQ(stripe.amplitude_dn[0], 100.0F);
}

TEST(PaperExtractor, AgreesWithThePlainSearchOnRandomImages) {
  for (int trial = 0; trial < 20; ++trial) {
    LitFrame frame;
    frame.full_scale_dn = 255;
    frame.lit = cv::Mat(37, 53, CV_8UC1);
    for (int v = 0; v < 37; ++v) {
      for (int u = 0; u < 53; ++u) {
        frame.lit.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(testing::uniform(0, 250));
      }
    }
    const Stripe stripe = extract(frame, 1.0);
    for (int u = 0; u < 53; ++u) {
      int best = 0;
      for (int v = 1; v < 37; ++v) {
        if (frame.lit.at<std::uint8_t>(v, u) > frame.lit.at<std::uint8_t>(best, u)) best = v;
      }
      const auto at = [&](int v) { return static_cast<double>(frame.lit.at<std::uint8_t>(v, u)); };
      const bool unique = best > 0 && best < 36 && at(best + 1) != at(best);
      if (!unique || stripe.status[static_cast<std::size_t>(u)] != ReturnStatus::kOk) continue;
      const double expected =
          ((best - 1) * at(best - 1) + best * at(best) + (best + 1) * at(best + 1)) /
          (at(best - 1) + at(best) + at(best + 1));
      EXPECT_NEAR(stripe.across_px[static_cast<std::size_t>(u)], expected, 1e-12) << "column " << u;
    }
  }
}

TEST(PaperExtractor, ErrorOfANoiselessStripeStaysWithinHalfAPixel) {
  SyntheticStripe synthetic;
  synthetic.lines = 400;
  synthetic.position = [](int line) { return 25.0 + 0.0137 * line; };
  for (const double sigma_px : {0.6, 0.9, 2.0}) {
    synthetic.sigma_px = sigma_px;
    const Stripe stripe = extract(testing::render(synthetic));
    for (std::size_t i = 0; i < stripe.size(); ++i) {
      ASSERT_EQ(stripe.status[i], ReturnStatus::kOk);
      EXPECT_NEAR(stripe.across_px[i], synthetic.position(static_cast<int>(i)), 0.5);
    }
  }
}

TEST(PaperExtractor, WidthIsTheGaussianSigmaOfTheProfile) {
  SyntheticStripe synthetic;
  for (const double sigma_px : {0.8, 1.5, 3.0}) {
    synthetic.sigma_px = sigma_px;
    const Stripe stripe = extract(testing::render(synthetic));
    const double seen = std::sqrt(sigma_px * sigma_px + 1.0 / 12.0);
    EXPECT_NEAR(stripe.width_px[7], seen, 0.12 * seen);
  }
}

TEST(PaperExtractor, NothingAboveTheThresholdIsNoStripe) {
  SyntheticStripe synthetic;
  synthetic.amplitude_dn = 20.0;
  const LitFrame frame = testing::render(synthetic);
  EXPECT_EQ(extract(frame, 15.0).status[3], ReturnStatus::kOk);
  const Stripe stripe = extract(frame, 25.0);
  EXPECT_EQ(stripe.status[3], ReturnStatus::kNoStripe);
  EXPECT_TRUE(std::isnan(stripe.across_px[3]));
  EXPECT_TRUE(std::isnan(stripe.amplitude_dn[3]));
}

TEST(PaperExtractor, AutomaticThresholdKeepsPureNoiseOut) {
  SyntheticStripe synthetic;
  synthetic.lines = 2000;
  synthetic.length = 240;
  synthetic.amplitude_dn = 0.0;
  synthetic.background_dn = 40.0;
  synthetic.noise_dn = 4.0;
  const Stripe stripe = extract(testing::render(synthetic));
  int found = 0;
  for (const ReturnStatus status : stripe.status) found += status == ReturnStatus::kOk ? 1 : 0;
  EXPECT_LE(found, 20) << "of 2000 columns without a stripe";
}

TEST(PaperExtractor, ClippedStripeIsFoundAtItsMiddle) {
  const Stripe stripe = extract(
      one_column({5, 5, 5, 5, 5, 5, 90, 255, 255, 255, 255, 90, 5, 5, 5, 5, 5, 5, 5}), 10.0);
  EXPECT_EQ(stripe.status[0], ReturnStatus::kOk);
  EXPECT_DOUBLE_EQ(stripe.across_px[0], 8.5);
}

TEST(PaperExtractor, WideClippedSpotIsSaturated) {
  std::vector<int> pixels(60, 5);
  std::fill(pixels.begin() + 20, pixels.begin() + 41, 255);
  EXPECT_EQ(extract(one_column(pixels), 10.0).status[0], ReturnStatus::kSaturated);
}

TEST(PaperExtractor, PeakInTheOutermostRowIsEdge) {
  EXPECT_EQ(extract(one_column({90, 20, 5, 5, 5, 5, 5, 5, 5, 5, 5}), 10.0).status[0],
            ReturnStatus::kEdge);
  EXPECT_EQ(extract(one_column({5, 5, 5, 5, 5, 5, 5, 5, 5, 20, 90}), 10.0).status[0],
            ReturnStatus::kEdge);
}

TEST(PaperExtractor, LineWhoseOnlyPeakIsMaskededIsMasked) {
  LitFrame frame = one_column({5, 5, 5, 5, 5, 5, 90, 5, 5, 5, 5, 5, 5, 5});
  frame.masked = cv::Mat::zeros(frame.lit.size(), CV_8UC1);
  frame.masked.at<std::uint8_t>(6, 0) = 255;
  EXPECT_EQ(extract(frame, 10.0).status[0], ReturnStatus::kBlind);
}

TEST(PaperExtractor, RowsAreColumnsOfTheTransposedImage) {
  SyntheticStripe synthetic;
  synthetic.noise_dn = 5.0;
  synthetic.position = [](int line) { return 20.0 + 0.31 * line; };
  const LitFrame frame = testing::render(synthetic);
  const Stripe columns = extract(frame, 20.0);
  const Stripe rows = extract(testing::transposed(frame), 20.0, StripeAxis::kRows);
  EXPECT_EQ(rows.across_px, columns.across_px);
  EXPECT_EQ(rows.status, columns.status);
  EXPECT_EQ(rows.v_px(9), 9.0);
  EXPECT_EQ(rows.u_px(9), columns.v_px(9));
}

TEST(PaperExtractor, DarkImageIsTakenOff) {
  SyntheticStripe synthetic;
  LitFrame frame = testing::render(synthetic);
  const Stripe clean = extract(frame, 20.0);
  frame.dark = cv::Mat(frame.lit.size(), CV_8UC1, cv::Scalar(0));
  frame.dark.row(50).setTo(120);
  frame.lit.row(50) += 120;  // A light source, brighter than the stripe.
  const Stripe subtracted = extract(frame, 20.0);
  EXPECT_EQ(subtracted.across_px, clean.across_px);
}

TEST(PaperExtractor, FieldLinesAreMappedToTheFullSensor) {
  SyntheticStripe synthetic;
  LitFrame frame = testing::render(synthetic);
  const Stripe plain = extract(frame);
  frame.grid = PixelGrid::bottom_field();
  const Stripe field = extract(frame);
  EXPECT_DOUBLE_EQ(field.v_px(5), 1.0 + 2.0 * plain.v_px(5));
  EXPECT_DOUBLE_EQ(field.half_pixel_px(), 1.0);
  EXPECT_FLOAT_EQ(field.sigma_px[5], 2.0F * plain.sigma_px[5]);
  EXPECT_FLOAT_EQ(field.width_px[5], 2.0F * plain.width_px[5]);
}

TEST(PaperExtractor, SixteenBitImagesGiveTheSamePlace) {
  SyntheticStripe synthetic;
  const Stripe eight = extract(testing::render(synthetic));
  synthetic.bit_depth = 16;
  synthetic.amplitude_dn *= 200.0;
  synthetic.background_dn *= 200.0;
  const Stripe sixteen = extract(testing::render(synthetic));
  EXPECT_NEAR(sixteen.across_px[4], eight.across_px[4], 0.01);
}

TEST(PaperExtractor, SaturatedLineIsMasked) {
  EXPECT_EQ(extract(one_column({255, 255, 255, 255, 255}), 10.0).status[0], ReturnStatus::kBlind);
}

TEST(PaperExtractor, ImageTooSmallForThreePixelsHasNoStripe) {
  EXPECT_EQ(extract(one_column({200, 10}), 10.0).status[0], ReturnStatus::kNoStripe);
}

TEST(ExtractOptions, RefuseAThresholdThatIsNotAboveZero) {
  ExtractOptions options;
  options.threshold_dn = -3.0;
  const Error error = testing::error_of([&] { make_extractor(options); });
  EXPECT_STREQ(error.what(), "threshold_dn is -3; expected a number of DN above 0");
}

}  // namespace
}  // namespace striper
