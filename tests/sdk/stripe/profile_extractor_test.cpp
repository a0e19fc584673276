// SPDX-License-Identifier: Apache-2.0
// Proves what the methods `fast` and `refined` promise of single frames: positions to a hundredth
// of a pixel, widths, amplitudes, both axes, both depths, grids, a dark image, why a scan line has
// no return, which peak is chosen, and that no memory is allocated per frame. Accuracy against the
// physical limit is proven in stripe_accuracy_test.cpp.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/instruction_sets.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

using testing::SyntheticStripe;

SyntheticStripe typical() {
  SyntheticStripe s;
  s.lines = 300;
  s.length = 240;
  s.position = [](int line) { return 120.0 + 40.0 * std::sin(0.02 * line); };
  s.sigma_px = 1.4;
  s.amplitude_dn = 120.0;
  s.background_dn = 20.0;
  s.noise_dn = 2.0;
  return s;
}

Stripe extract(const LitFrame& frame, const ExtractOptions& options) {
  Stripe stripe;
  make_extractor(options)->extract(frame, stripe);
  return stripe;
}

double rms_error(const Stripe& stripe, const SyntheticStripe& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const double d = stripe.across_px[i] - truth.position(stripe.line[i]);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(stripe.size()));
}

int count_of(const Stripe& stripe, ReturnStatus status) {
  return static_cast<int>(std::count(stripe.status.begin(), stripe.status.end(), status));
}

double mean_of(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

class BothMethods : public ::testing::TestWithParam<ExtractMethod> {
 protected:
  ExtractOptions options() const {
    ExtractOptions options;
    options.method = GetParam();
    return options;
  }
};

TEST_P(BothMethods, MeasurePositionWidthAmplitudeAndTheirOwnError) {
  const SyntheticStripe s = typical();
  const Stripe stripe = extract(testing::render(s), options());
  EXPECT_EQ(count_of(stripe, ReturnStatus::kOk), s.lines);
  EXPECT_LT(rms_error(stripe, s), 0.03);
  EXPECT_NEAR(mean_of(stripe.sigma_px), rms_error(stripe, s), 0.12 * rms_error(stripe, s));
  EXPECT_NEAR(mean_of(stripe.width_px), s.sigma_px, 0.02 * s.sigma_px);
  const double peak = testing::box_gaussian(0.0, 0.0, s.sigma_px, s.amplitude_dn);
  EXPECT_NEAR(mean_of(stripe.amplitude_dn), peak, 0.02 * peak);
  EXPECT_GT(mean_of(stripe.confidence), 0.999);
}

TEST_P(BothMethods, RowsAreColumnsTransposed) {
  const LitFrame frame = testing::render(typical());
  ExtractOptions rows = options();
  rows.axis = StripeAxis::kRows;
  const Stripe a = extract(frame, options());
  const Stripe b = extract(testing::transposed(frame), rows);
  ASSERT_EQ(a.size(), b.size());
  // Windows may be centred a pixel or two apart, which lets other pixels of the background in.
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double difference = (a.across_px[i] - b.across_px[i]) / a.sigma_px[i];
    sum += difference * difference;
    EXPECT_LT(std::abs(difference), 0.6) << i;
    EXPECT_NEAR(a.sigma_px[i], b.sigma_px[i], 0.1 * a.sigma_px[i]) << i;
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(a.size())), 0.15);
}

// Its block rises above neither of those next to it, which a bright wall crosses, while the wall's
// own border is the most prominent thing of the scan line. Not always: noise on that border, where
// the background is no straight line, can be a higher peak.
TEST_P(BothMethods, FindAWeakStripeBetweenBrightSurfaces) {
  SyntheticStripe s = typical();
  s.length = 320;
  s.position = [](int line) { return 143.0 + 6.0 * std::sin(0.02 * line); };
  s.amplitude_dn = 9.0;
  s.background_dn = 20.0;
  s.noise_dn = 1.0;
  LitFrame frame = testing::render(s);
  frame.lit.rowRange(0, 126) += 6.0;
  frame.lit.rowRange(162, 250) += 6.0;
  frame.lit.rowRange(250, 320) -= 2.0;
  ExtractOptions o = options();
  o.stripe_sigma_px = s.sigma_px;
  const Stripe stripe = extract(frame, o);
  int found = 0;
  int wrong = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const bool is_near = std::abs(stripe.across_px[i] - s.position(stripe.line[i])) < 1.5;
    found += is_near ? 1 : 0;
    wrong += !is_near && stripe.status[i] == ReturnStatus::kOk ? 1 : 0;
  }
  EXPECT_GE(found, static_cast<int>(0.8 * s.lines));
  EXPECT_LE(wrong, static_cast<int>(0.05 * s.lines));
}

TEST_P(BothMethods, SixteenBitsAreAsGoodAsEight) {
  SyntheticStripe s = typical();
  s.bit_depth = 12;
  s.amplitude_dn *= 16.0;
  s.background_dn *= 16.0;
  s.noise_dn *= 16.0;
  const Stripe stripe = extract(testing::render(s), options());
  EXPECT_EQ(count_of(stripe, ReturnStatus::kOk), s.lines);
  EXPECT_LT(rms_error(stripe, s), 0.03);
}

TEST_P(BothMethods, FieldGridScalesPositionErrorAndWidth) {
  LitFrame frame = testing::render(typical());
  const Stripe plain = extract(frame, options());
  frame.grid = PixelGrid::bottom_field();
  const Stripe field = extract(frame, options());
  EXPECT_NEAR(field.across_px[7], 1.0 + 2.0 * plain.across_px[7], 1e-9);
  EXPECT_NEAR(field.sigma_px[7], 2.0 * plain.sigma_px[7], 1e-3 * plain.sigma_px[7]);
  EXPECT_FLOAT_EQ(field.width_px[7], 2.0F * plain.width_px[7]);
}

TEST_P(BothMethods, DarkImageIsTakenOff) {
  const SyntheticStripe s = typical();
  LitFrame frame = testing::render(s);
  frame.dark = cv::Mat(frame.lit.size(), frame.lit.type());
  for (int v = 0; v < frame.lit.rows; ++v) {
    for (int u = 0; u < frame.lit.cols; ++u) {
      const int sun = v < 100 ? 60 : 5;
      frame.lit.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(std::min(255, frame.lit.at<std::uint8_t>(v, u) + sun));
      frame.dark.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(sun);
    }
  }
  const Stripe stripe = extract(frame, options());
  EXPECT_EQ(count_of(stripe, ReturnStatus::kOk), s.lines);
  EXPECT_LT(rms_error(stripe, s), 0.03);
}

// A dark exposure whose rows were interpolated halfway between those of the other field.
void interpolate_dark(const SyntheticStripe& lit, LitFrame& frame) {
  SyntheticStripe other = lit;
  other.amplitude_dn = 0.0;
  other.length = lit.length + 3;
  const cv::Mat rows = testing::render(other).lit;
  frame.dark.create(frame.lit.size(), CV_16UC1);
  for (int v = 0; v < frame.dark.rows; ++v) {
    for (int u = 0; u < frame.dark.cols; ++u) {
      const auto row = [&](int k) -> double { return rows.at<std::uint16_t>(v + k, u); };
      const double halfway = (9.0 * (row(1) + row(2)) - row(0) - row(3)) / 16.0;
      frame.dark.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(std::lround(halfway));
    }
  }
  frame.dark_noise_gain = 164.0F / 256.0F;
  frame.dark_noise_correlation = {63.0F / 164.0F, -18.0F / 164.0F, 1.0F / 164.0F};
}

TEST_P(BothMethods, NoiseThatDarkRowsShareIsCountedWhetherGivenOrMeasured) {
  SyntheticStripe s = typical();
  s.lines = 4000;
  s.bit_depth = 12;
  s.amplitude_dn = 600.0;
  s.background_dn = 300.0;
  s.noise_dn = 20.0;
  LitFrame frame = testing::render(s);
  interpolate_dark(s, frame);
  ExtractOptions given = options();
  given.noise = NoiseModel{.read_noise_dn = s.noise_dn};
  const Stripe known = extract(frame, given);
  const Stripe measured = extract(frame, options());
  EXPECT_NEAR(mean_of(measured.sigma_px), mean_of(known.sigma_px), 0.03 * mean_of(known.sigma_px));
  for (const Stripe* stripe : {&known, &measured}) {
    ASSERT_EQ(count_of(*stripe, ReturnStatus::kOk), s.lines);
    std::vector<double> pulls;
    for (std::size_t i = 0; i < stripe->size(); ++i) {
      const double error = stripe->across_px[i] - s.position(stripe->line[i]);
      pulls.push_back(std::abs(error) / stripe->sigma_px[i]);
    }
    std::nth_element(pulls.begin(), pulls.begin() + 2000, pulls.end());
    const double robust_deviation = 1.4826 * pulls[2000];
    EXPECT_GT(robust_deviation, 0.95);
    EXPECT_LT(robust_deviation, 1.05);
  }
}

TEST_P(BothMethods, SameAnswerOnEveryInstructionSet) {
  const LitFrame frame = testing::render(typical());
  const Stripe expected = extract(frame, options());
  testing::for_each_instruction_set([&] {
    const Stripe stripe = extract(frame, options());
    for (std::size_t i = 0; i < stripe.size(); ++i) {
      ASSERT_EQ(stripe.status[i], expected.status[i]);
      ASSERT_NEAR(stripe.across_px[i], expected.across_px[i], 2e-3) << i;
    }
  });
}

TEST_P(BothMethods, EmptyLinesAreNoStripe) {
  SyntheticStripe s = typical();
  s.lines = 2000;
  s.amplitude_dn = 0.0;
  const Stripe stripe = extract(testing::render(s), options());
  EXPECT_LE(count_of(stripe, ReturnStatus::kOk), 1);
  EXPECT_LE(s.lines - count_of(stripe, ReturnStatus::kNoStripe), 6) << "of 2000, 2 expected";
}

TEST_P(BothMethods, ConstantImagesOfEverySizeHaveNoStripe) {
  for (const int rows : {1, 2, 3, 4, 7, 31, 33}) {
    for (const int cols : {1, 2, 5, 16, 17}) {
      LitFrame frame;
      frame.full_scale_dn = 255;
      frame.lit = cv::Mat(rows, cols, CV_8UC1, cv::Scalar(70));
      const Stripe stripe = extract(frame, options());
      EXPECT_EQ(count_of(stripe, ReturnStatus::kNoStripe), cols) << rows << "x" << cols;
    }
  }
}

TEST_P(BothMethods, SaturatedLinesAreMasked) {
  LitFrame frame;
  frame.full_scale_dn = 255;
  frame.lit = cv::Mat(33, 17, CV_8UC1, cv::Scalar(255));
  frame.lit.colRange(0, 5).setTo(70);
  const Stripe stripe = extract(frame, options());
  EXPECT_EQ(count_of(stripe, ReturnStatus::kNoStripe), 5);
  EXPECT_EQ(count_of(stripe, ReturnStatus::kBlind), 12);
}

TEST_P(BothMethods, LightSourceIsWideHotPixelIsNarrowBorderIsEdge) {
  SyntheticStripe s = typical();
  s.position = [](int) { return 120.0; };
  s.sigma_px = 2.0;
  LitFrame frame = testing::render(s);
  const auto replace = [&](int column, double centre, double sigma_px) {
    for (int v = 0; v < frame.lit.rows; ++v) {
      const double light = 20.0 + testing::box_gaussian(v, centre, sigma_px, 120.0);
      frame.lit.at<std::uint8_t>(v, column) = static_cast<std::uint8_t>(std::lround(light));
    }
  };
  replace(100, 60.0, 6.0);
  replace(150, 60.0, 0.3);
  replace(200, 0.4, 2.0);
  const Stripe stripe = extract(frame, options());
  EXPECT_EQ(stripe.status[100], ReturnStatus::kWide);
  EXPECT_EQ(stripe.status[150], ReturnStatus::kNarrow);
  EXPECT_EQ(stripe.status[200], ReturnStatus::kEdge);
  EXPECT_EQ(count_of(stripe, ReturnStatus::kOk), s.lines - 3);
}

// The width is the stripe's, which shows in many scan lines faintly, not that of what shows in a
// few brightly.
TEST_P(BothMethods, LightSourcesBesideAFaintStripeDoNotWidenIt) {
  SyntheticStripe s = typical();
  s.amplitude_dn = 18.0;
  const std::unique_ptr<StripeExtractor> extractor = make_extractor(options());
  Stripe stripe;
  for (int n = 0; n < 12; ++n) {
    LitFrame frame = testing::render(s);
    for (int u = 0; u < s.lines; ++u) {
      if (u % 40 >= 10) continue;
      for (int v = 190; v < 240; ++v) {
        auto& pixel = frame.lit.at<std::uint8_t>(v, u);
        const double light_source = testing::box_gaussian(v, 215.0, 4.0 + u % 7, 100.0);
        pixel = static_cast<std::uint8_t>(std::min(255.0, pixel + light_source));
      }
    }
    extractor->extract(frame, stripe);
  }
  int good = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const bool is_on_stripe = std::abs(stripe.across_px[i] - s.position(stripe.line[i])) < 1.0;
    good += stripe.status[i] == ReturnStatus::kOk && is_on_stripe ? 1 : 0;
  }
  EXPECT_GE(good, s.lines * 95 / 100) << "their own light sources are too wide to be the stripe";
}

// A fifth of the scan lines show something brighter, high above the stripe, some of it about as
// narrow: no slope of the stripe's width, which would let the rest of it pass, the more the longer.
TEST_P(BothMethods, EdgesFarFromALevelStripeDoNotTiltItsWidth) {
  SyntheticStripe s;
  s.lines = 320;
  s.length = 200;
  s.sigma_px = 1.7;
  s.amplitude_dn = 60.0;
  s.noise_dn = 9.0;
  s.position = [](int line) { return 165.0 + 0.03 * line; };
  const std::unique_ptr<StripeExtractor> extractor = make_extractor(options());
  Stripe stripe;
  for (int image = 0; image < 10; ++image) {
    LitFrame frame = testing::render(s);
    for (int u = 0; u < s.lines; u += 5) {
      const double sigma = testing::uniform(2.0, 4.5);
      const double row = testing::uniform(20.0, 80.0);
      for (int v = 0; v < 110; ++v) {
        auto& pixel = frame.lit.at<std::uint8_t>(v, u);
        const double light = pixel + testing::box_gaussian(v, row, sigma, 110.0);
        pixel = static_cast<std::uint8_t>(std::min(254.0, light));
      }
    }
    extractor->extract(frame, stripe);
  }
  int too_wide = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const bool is_good = stripe.status[i] == ReturnStatus::kOk;
    too_wide += static_cast<int>(is_good && stripe.width_px[i] > 2.3 * s.sigma_px);
  }
  EXPECT_EQ(too_wide, 0);
}

TEST_P(BothMethods, MaskedLinesWithoutAReturnSaySo) {
  SyntheticStripe s = typical();
  LitFrame frame = testing::render(s);
  frame.masked = cv::Mat::zeros(frame.lit.size(), CV_8UC1);
  const int centre = static_cast<int>(s.position(50));
  frame.masked(cv::Rect(50, centre - 12, 1, 24)) = cv::Scalar(255);
  frame.masked.at<std::uint8_t>(5, 60) = 255;
  const Stripe stripe = extract(frame, options());
  EXPECT_EQ(stripe.status[50], ReturnStatus::kBlind);
  EXPECT_EQ(stripe.status[60], ReturnStatus::kOk);
}

// Whatever comes after the first frames: noise, nothing, a faint stripe, a clipped one.
TEST_P(BothMethods, AllocateNothingPerFrame) {
  std::vector<LitFrame> frames;
  for (const double noise_dn : {0.0, 2.0, 60.0}) {
    for (const double amplitude_dn : {0.0, 8.0, 120.0, 400.0}) {
      SyntheticStripe s = typical();
      s.noise_dn = noise_dn;
      s.amplitude_dn = amplitude_dn;
      frames.push_back(testing::render(s));
    }
  }
  for (const PeakRule peak : {PeakRule::kBrightest, PeakRule::kContinuous, PeakRule::kAll}) {
    ExtractOptions o = options();
    o.peak = peak;
    const std::unique_ptr<StripeExtractor> extractor = make_extractor(o);
    Stripe stripe;
    const LitFrame first = testing::render(typical());
    for (int n = 0; n < 3; ++n) extractor->extract(first, stripe);
    const testing::AllocationCounter counter;
    for (const LitFrame& frame : frames) extractor->extract(frame, stripe);
    EXPECT_EQ(counter.count(), 0U) << static_cast<int>(peak);
  }
}

std::string name_of(const ::testing::TestParamInfo<ExtractMethod>& method) {
  return method.param == ExtractMethod::kFast ? "Fast" : "Refined";
}

INSTANTIATE_TEST_SUITE_P(ProfileExtractor, BothMethods,
                         ::testing::Values(ExtractMethod::kFast, ExtractMethod::kRefined), name_of);

// Two stripes, the upper one at row 60 half as bright as the lower one at row 150.
LitFrame two_stripes(double upper_amplitude) {
  SyntheticStripe s = typical();
  s.position = [](int) { return 150.3; };
  LitFrame frame = testing::render(s);
  for (int v = 40; v < 80; ++v) {
    for (int u = 0; u < s.lines; ++u) {
      const double light = testing::box_gaussian(v, 60.7, s.sigma_px, upper_amplitude);
      auto& pixel = frame.lit.at<std::uint8_t>(v, u);
      pixel = static_cast<std::uint8_t>(std::lround(pixel + light));
    }
  }
  return frame;
}

TEST(PeakRule, ChoosesAmongTwoStripes) {
  const LitFrame frame = two_stripes(60.0);
  ExtractOptions options;
  EXPECT_NEAR(extract(frame, options).across_px[9], 150.3, 0.1);
  options.peak = PeakRule::kNearest;
  EXPECT_NEAR(extract(frame, options).across_px[9], 150.3, 0.1);
  options.peak = PeakRule::kFarthest;
  EXPECT_NEAR(extract(frame, options).across_px[9], 60.7, 0.2);
  options.near_end = NearEnd::kFirstPixel;
  EXPECT_NEAR(extract(frame, options).across_px[9], 150.3, 0.1);
  options.peak = PeakRule::kNearest;
  EXPECT_NEAR(extract(frame, options).across_px[9], 60.7, 0.2);
}

TEST(PeakRule, AllGivesEveryPeakInOrder) {
  ExtractOptions options;
  options.peak = PeakRule::kAll;
  const Stripe stripe = extract(two_stripes(60.0), options);
  ASSERT_EQ(stripe.size(), 600U);
  EXPECT_EQ(stripe.line_count, 300);
  for (std::size_t i = 0; i < stripe.size(); i += 2) {
    EXPECT_EQ(stripe.line[i], stripe.line[i + 1]);
    EXPECT_NEAR(stripe.across_px[i], 60.7, 0.2);
    EXPECT_NEAR(stripe.across_px[i + 1], 150.3, 0.1);
  }
}

TEST(PeakRule, RivalsAboutAsHighAreAmbiguous) {
  const ExtractOptions options;
  const Stripe clear = extract(two_stripes(60.0), options);
  EXPECT_EQ(count_of(clear, ReturnStatus::kOk), 300);
  EXPECT_GT(mean_of(clear.confidence), 0.9);
  const Stripe rivals = extract(two_stripes(115.0), options);
  EXPECT_GT(count_of(rivals, ReturnStatus::kAmbiguous), 290);
  EXPECT_LT(mean_of(rivals.confidence), 0.6);
}

TEST(ExtractOptions, RefusesValuesOutOfBoundsNamingThem) {
  const auto refuses = [](auto change, const std::string& field) {
    ExtractOptions options;
    change(options);
    SCOPED_TRACE(field);
    const Error error = testing::error_of([&] { options.validate(); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
    EXPECT_EQ(std::string(error.what()).rfind(field, 0), 0U) << error.what();
  };
  refuses([](ExtractOptions& o) { o.threshold_dn = 0.0; }, "threshold_dn");
  refuses([](ExtractOptions& o) { o.false_alarm_rate = 1.0; }, "false_alarm_rate");
  refuses([](ExtractOptions& o) { o.weak_false_alarm_rate = 0.1; }, "weak_false_alarm_rate");
  refuses([](ExtractOptions& o) { o.min_width_ratio = 1.2; }, "min_width_ratio");
  refuses([](ExtractOptions& o) { o.max_width_ratio = 0.9; }, "max_width_ratio");
  refuses([](ExtractOptions& o) { o.min_snr = -1.0; }, "min_snr");
  refuses([](ExtractOptions& o) { o.stripe_sigma_px = 0.0; }, "stripe_sigma_px");
  refuses([](ExtractOptions& o) { o.excess_sigma_px = -0.1; }, "excess_sigma_px");
  refuses([](ExtractOptions& o) { o.speckle_contrast = -0.1; }, "speckle_contrast");
}

// What no scan line shows by itself is tracked to the border, and said to be cut off there.
TEST(ProfileExtractor, ContinuousStripeThatLeavesTheImageIsAtItsEdge) {
  testing::reseed();
  SyntheticStripe s = typical();
  s.position = [](int line) { return 228.0 + 0.05 * line; };
  s.amplitude_dn = 5.0;  // 2.5 sigmas a pixel.
  ExtractOptions options;
  options.peak = PeakRule::kContinuous;
  options.stripe_sigma_px = s.sigma_px;
  int at_edge = 0;
  for (int n = 0; n < 10; ++n) {
    const Stripe stripe = extract(testing::render(s), options);
    at_edge += count_of(stripe, ReturnStatus::kEdge);
    for (std::size_t i = 0; i < stripe.size(); ++i) {
      if (stripe.status[i] != ReturnStatus::kOk) continue;
      EXPECT_LE(stripe.across_px[i], s.length - 1 - s.sigma_px) << stripe.line[i];
    }
  }
  EXPECT_GT(at_edge, 100);
}

// Bridged scan lines, too, which show next to nothing themselves: the chain knows where they are.
TEST(ProfileExtractor, ContinuousStripeKnowsItsErrorWhereNoLineShowsIt) {
  SyntheticStripe s = typical();
  s.amplitude_dn = 3.0;  // 1.5 sigmas a pixel.
  ExtractOptions options;
  options.peak = PeakRule::kContinuous;
  options.stripe_sigma_px = s.sigma_px;
  double squares = 0.0;
  int hardly_seen = 0;
  for (int n = 0; n < 10; ++n) {
    const Stripe stripe = extract(testing::render(s), options);
    for (std::size_t i = 0; i < stripe.size(); ++i) {
      if (stripe.status[i] != ReturnStatus::kOk) continue;
      EXPECT_LT(stripe.sigma_px[i], 2.0F) << stripe.line[i];
      EXPECT_GT(stripe.amplitude_dn[i], 0.0F) << stripe.line[i];
      if (stripe.sigma_px[i] < 1.4F) continue;
      const double error = stripe.across_px[i] - s.position(stripe.line[i]);
      squares += error * error / (stripe.sigma_px[i] * stripe.sigma_px[i]);
      ++hardly_seen;
    }
  }
  EXPECT_GT(hardly_seen, 100);
  EXPECT_LT(std::sqrt(squares / hardly_seen), 1.0);
}

// Of pixels of any value, a third of which are masked, a profile may say nothing of its place.
TEST(ProfileExtractor, WhatIsGoodIsSomewhere) {
  ExtractOptions options;
  options.noise = NoiseModel{1.5, 0.02, 4.0};
  for (int n = 0; n < 30; ++n) {
    LitFrame frame;
    frame.lit = cv::Mat(40, 200, CV_8UC1);
    frame.masked = cv::Mat::zeros(frame.lit.size(), CV_8UC1);
    frame.full_scale_dn = 255;
    for (int v = 0; v < frame.lit.rows; ++v) {
      for (int u = 0; u < frame.lit.cols; ++u) {
        frame.lit.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(testing::uniform(0.0, 255.0));
        frame.masked.at<std::uint8_t>(v, u) = testing::uniform(0.0, 3.0) < 1.0 ? 255 : 0;
      }
    }
    const Stripe stripe = extract(frame, options);
    for (std::size_t i = 0; i < stripe.size(); ++i) {
      if (stripe.status[i] != ReturnStatus::kOk) continue;
      EXPECT_LT(stripe.sigma_px[i], 20.0F) << i;
    }
  }
}

}  // namespace
}  // namespace striper
