// SPDX-License-Identifier: Apache-2.0
// Proves that a colour difference shows a stripe that is clipped to white where it is, as well as
// the stripe's own colour does: down columns and along rows, in 8, 10 and 16 bits, green and red.
// And that it still leaves out what a difference is for: white surfaces, markings and specular
// highlights, on grey and on coloured ground; those that are clipped are masked.
#include "ambient/pixels/colour_difference.hpp"

#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/allocation_counter.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using detail::ColourDifference;

const cv::Size kSize(240, 160);
constexpr double kSigma_px = 1.3;

// Where the stripe is in a column.
double truth_px(int column) { return 70.0 + 0.1 * column; }

struct Laser {
  double line_dn;
  // What the other colours' filters let through of it.
  double leak;
};

constexpr Laser kClipped{2000.0, 0.4};

// A grey ground, a little brighter above than below.
const cv::Vec3d kGrey(60.0, 60.0, 60.0);
const cv::Vec3d kGrass(60.0, 110.0, 70.0);

// A stripe across a ground, in 8 bits: B, G, R, the laser of colour number `colour`.
cv::Mat image_of(const Laser& laser, const cv::Vec3d& ground_dn = kGrey, int colour = 1) {
  cv::Mat image(kSize, CV_8UC3);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double t = (v - truth_px(u)) / kSigma_px;
      const double line_dn = laser.line_dn * std::exp(-0.5 * t * t);
      for (int c = 0; c < 3; ++c) {
        const double dn = ground_dn[c] - 0.1 * v + (c == colour ? 1.0 : laser.leak) * line_dn;
        image.at<cv::Vec3b>(v, u)[c] = cv::saturate_cast<std::uint8_t>(dn + testing::normal());
      }
    }
  }
  return image;
}

struct Way {
  Channel channel = Channel::kGreenMinusRed;
  ExtractMethod method = ExtractMethod::kRefined;
  StripeAxis axis = StripeAxis::kColumns;
  int bit_depth = 8;
};

Stripe stripe_of(const cv::Mat& image, const Way& way) {
  AmbientOptions ambient;
  ambient.method = AmbientMethod::kNone;
  ambient.channel = way.channel;
  ambient.axis = way.axis;
  AmbientStage stage(ambient);
  Frame frame;
  frame.image = image;
  frame.bit_depth = way.bit_depth;
  stage.push(frame);
  stage.finish();
  const LitFrame* const lit = stage.next();
  EXPECT_NE(lit, nullptr);
  ExtractOptions options;
  options.method = way.method;
  options.axis = way.axis;
  Stripe stripe;
  if (lit != nullptr) make_extractor(options)->extract(*lit, stripe);
  return stripe;
}

struct Found {
  int good = 0;
  int wrong = 0;
  std::vector<double> errors_px;  // Of the good ones.
  std::vector<double> pulls;

  double mean_error_px() const { return mean(errors_px); }
  double rms_pull() const {
    std::vector<double> squares;
    for (const double pull : pulls) squares.push_back(pull * pull);
    return std::sqrt(mean(squares));
  }

 private:
  static double mean(const std::vector<double>& values) {
    const double sum = std::accumulate(values.begin(), values.end(), 0.0);
    return sum / static_cast<double>(values.size());
  }
};

Found found_in(const Stripe& stripe) {
  Found found;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kOk) continue;
    const double error_px = stripe.across_px[i] - truth_px(stripe.line[i]);
    const bool is_right = std::abs(error_px) < 1.0;
    ++(is_right ? found.good : found.wrong);
    if (!is_right) continue;
    found.errors_px.push_back(error_px);
    found.pulls.push_back(error_px / stripe.sigma_px[i]);
  }
  return found;
}

int count_of(const Stripe& stripe, ReturnStatus status) {
  return static_cast<int>(std::count(stripe.status.begin(), stripe.status.end(), status));
}

class ClippedLine : public ::testing::TestWithParam<ExtractMethod> {
 protected:
  static void expect_found(const cv::Mat& image, const Way& way) {
    SCOPED_TRACE(::testing::Message() << to_string(way.channel) << ", " << way.bit_depth
                                      << " bits, axis " << to_string(way.axis));
    const Found found = found_in(stripe_of(image, way));
    EXPECT_GE(found.good, kSize.width * 98 / 100);
    EXPECT_EQ(found.wrong, 0);
    EXPECT_NEAR(found.mean_error_px(), 0.0, 0.05);
    if (way.method == ExtractMethod::kRefined) {
      EXPECT_LT(found.rms_pull(), 1.3);
    }
  }
};

TEST_P(ClippedLine, IsWhereItIs) {
  Way way;
  way.method = GetParam();
  const cv::Mat image = image_of(kClipped);
  expect_found(image, way);

  cv::Mat deep;
  image.convertTo(deep, CV_16U, 1023.0 / 255.0);
  way.bit_depth = 10;
  expect_found(deep, way);
  image.convertTo(deep, CV_16U, 257.0);
  way.bit_depth = 16;
  expect_found(deep, way);

  way.bit_depth = 8;
  way.axis = StripeAxis::kRows;
  expect_found(image.t(), way);

  way.axis = StripeAxis::kColumns;
  way.channel = Channel::kRedMinusGreen;
  expect_found(image_of(kClipped, kGrey, 2), way);
}

// White markings, wide and narrow, that run as a laser's stripe might; the laser is off, or
// elsewhere and not clipped.
TEST_P(ClippedLine, IsNoMarkingOnColouredGround) {
  Way way;
  way.method = GetParam();
  for (const cv::Vec3d& ground_dn : {kGrey, kGrass, cv::Vec3d(60.0, 85.0, 70.0)}) {
    for (const int height : {2, 3, 5, 9, 20}) {
      for (const double laser_dn : {0.0, 70.0}) {
        // Without a stripe the noise of the ground passes paper's threshold now and then.
        if (laser_dn == 0.0 && GetParam() == ExtractMethod::kPaper) continue;
        SCOPED_TRACE(::testing::Message() << ground_dn << " " << height << " " << laser_dn);
        cv::Mat image = image_of({laser_dn, 0.1}, ground_dn);
        image.rowRange(30, 30 + height).setTo(cv::Scalar(255, 255, 255));
        const Found found = found_in(stripe_of(image, way));
        EXPECT_LE(found.wrong, kSize.width / 100);
        if (laser_dn > 0.0 && ground_dn == kGrey) {
          EXPECT_GE(found.good, kSize.width * 98 / 100);
        }
      }
    }
  }
}

TEST_P(ClippedLine, OnAWhiteSheetIsMaskedWhereBothColoursAreClipped) {
  Way way;
  way.method = GetParam();
  const cv::Mat white(kSize, CV_8UC3, cv::Scalar(255, 255, 255));
  EXPECT_EQ(count_of(stripe_of(white, way), ReturnStatus::kBlind), kSize.width);

  // Half of it, from either end.
  const cv::Mat grey(kSize, CV_8UC3, cv::Scalar(60, 60, 60));
  for (const auto& [first, second] : {std::pair(white, grey), std::pair(grey, white)}) {
    cv::Mat image = first.clone();
    second.rowRange(0, 80).copyTo(image.rowRange(80, 160));
    EXPECT_EQ(count_of(stripe_of(image, way), ReturnStatus::kBlind), kSize.width);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, ClippedLine,
                         ::testing::Values(ExtractMethod::kPaper, ExtractMethod::kRefined),
                         [](const auto& method) {
                           return method.param == ExtractMethod::kPaper ? "paper" : "refined";
                         });

LitFrame difference_of(const cv::Mat& image) {
  LitFrame frame;
  frame.full_scale_dn = 255;
  cv::extractChannel(image, frame.lit, 1);
  cv::extractChannel(image, frame.dark, 2);
  return frame;
}

// Most of what was taken from the colour that is subtracted.
double most_corrected_dn(const cv::Mat& image) {
  LitFrame frame = difference_of(image);
  const cv::Mat before = frame.dark;
  ColourDifference difference;
  difference.correct(frame, StripeAxis::kColumns);
  return cv::norm(before, frame.dark, cv::NORM_INF);
}

TEST(ColourDifference, IsCorrectedOnlyWhereItIsHollow) {
  EXPECT_GT(most_corrected_dn(image_of(kClipped)), 100.0);
  EXPECT_EQ(most_corrected_dn(image_of({180.0, 0.4})), 0.0) << "not clipped";
  EXPECT_EQ(most_corrected_dn(image_of({300.0, 0.1})), 0.0) << "clipped in green alone";
}

TEST(ColourDifference, IsNotCorrectedAtWhiteThings) {
  cv::Mat image = image_of({180.0, 0.2});
  image(cv::Rect(10, 20, 60, 50)).setTo(cv::Scalar(255, 255, 255));
  image(cv::Rect(90, 40, 7, 7)).setTo(cv::Scalar(255, 255, 255));
  EXPECT_EQ(most_corrected_dn(image), 0.0);
}

TEST(ColourDifference, WritesIntoNoImage) {
  const cv::Mat image = image_of(kClipped);
  LitFrame frame = difference_of(image);
  const LitFrame before = frame;
  const cv::Mat lit = frame.lit.clone();
  const cv::Mat dark = frame.dark.clone();
  ColourDifference difference;
  difference.correct(frame, StripeAxis::kColumns);
  EXPECT_EQ(cv::norm(before.lit, lit, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(before.dark, dark, cv::NORM_INF), 0.0);
  EXPECT_NE(frame.dark.data, before.dark.data);
}

// The stripe becomes clipped late in a stream.
TEST(ColourDifference, AllocatesNothingAfterTheFirstFrame) {
  LitFrame plain = difference_of(image_of({100.0, 0.4}));
  cv::Mat image = image_of(kClipped);
  image(cv::Rect(90, 20, 7, 7)).setTo(cv::Scalar(255, 255, 255));
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    LitFrame clipped = difference_of(axis == StripeAxis::kColumns ? image : cv::Mat(image.t()));
    if (axis == StripeAxis::kRows) plain = difference_of(image_of({100.0, 0.4}).t());
    ColourDifference difference;
    difference.correct(plain, axis);
    const testing::AllocationCounter counter;
    difference.correct(clipped, axis);
    EXPECT_EQ(counter.count(), 0U);
    EXPECT_EQ(cv::countNonZero(clipped.masked), 49);
  }
}

TEST(ColourDifference, OfTinyImagesIsTakenAsItIs) {
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(3, 1), cv::Size(1, 3), cv::Size(2, 2)}) {
      LitFrame frame = difference_of(cv::Mat(size, CV_8UC3, cv::Scalar(255, 255, 255)));
      ColourDifference difference;
      difference.correct(frame, axis);
      EXPECT_EQ(cv::countNonZero(frame.masked), size.area());
    }
  }
}

}  // namespace
}  // namespace striper
