// SPDX-License-Identifier: Apache-2.0
// Proves that what comes out of the ambient stage is lit minus dark with the variance and the
// masked mask that belong to it: noise, motion, fields, bit depths, light sources, a standing
// sensor. The search for the stripe itself is not part of it.
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/ambient/ambient_stage.hpp>

#include "support/street.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using testing::Street;

// All lit frames of a street.
template <typename Action>
void for_each_lit(const Street& street, int frames, const Action& action) {
  AmbientOptions options;
  options.pattern = street.pattern;
  AmbientStage stage(options);
  for (int sequence = 0; sequence < frames; ++sequence) {
    stage.push(street.frame(static_cast<std::uint64_t>(sequence)));
    while (const LitFrame* const lit = stage.next()) action(*lit);
  }
}

cv::Mat residual_of(const LitFrame& lit) {
  cv::Mat a;
  cv::Mat b;
  lit.lit.convertTo(a, CV_32F);
  lit.dark.convertTo(b, CV_32F);
  return a - b;
}

TEST(Subtraction, StillSceneLeavesTheNoiseThatTheGainSays) {
  testing::reseed();
  Street street;
  street.amplitude_dn = 0.0;
  street.build();
  int frames = 0;
  for_each_lit(street, 8, [&](const LitFrame& lit) {
    cv::Scalar mean;
    cv::Scalar deviation;
    cv::meanStdDev(residual_of(lit), mean, deviation);
    const double one = street.noise_dn * street.noise_dn + 1.0 / 12.0;
    EXPECT_NEAR(deviation[0], std::sqrt(one * (1.0 + lit.dark_noise_gain)), 0.05);
    EXPECT_NEAR(mean[0], 0.0, 0.3);
    EXPECT_TRUE(lit.variance.empty());
    EXPECT_TRUE(lit.masked.empty());
    ++frames;
  });
  EXPECT_EQ(frames, 4);
}

// Residual in sigmas: what is left must be no larger than the variance says.
double pull_deviation(const LitFrame& lit, double noise_dn) {
  const cv::Mat residual = residual_of(lit);
  const double one = (noise_dn * noise_dn + 1.0 / 12.0) * (1.0 + lit.dark_noise_gain);
  double sum = 0.0;
  for (int v = 0; v < residual.rows; ++v) {
    for (int u = 0; u < residual.cols; ++u) {
      const double extra = lit.variance.empty() ? 0.0 : lit.variance.at<float>(v, u);
      sum += std::pow(residual.at<float>(v, u), 2) / (one + extra);
    }
  }
  return std::sqrt(sum / static_cast<double>(residual.total()));
}

// What moves slowly is cancelled by the mean of before and after better than the variance says.
TEST(Subtraction, MotionIsInTheVariance) {
  for (const double speed : {1.0, 5.0, 20.0, 51.0}) {
    testing::reseed();
    Street street;
    street.amplitude_dn = 0.0;
    street.speed_px = speed;
    street.build();
    for_each_lit(street, 9, [&](const LitFrame& lit) {
      if (lit.sequence == 0) return;  // One side only, nothing known of motion.
      const double pull = pull_deviation(lit, street.noise_dn);
      EXPECT_LT(pull, 1.1) << speed;
      EXPECT_GT(pull, speed < 2.0 ? 0.15 : 0.4) << speed;
    });
  }
}

TEST(Subtraction, FieldsAreInterpolatedBetweenTheDarkRows) {
  for (const Field order : {Field::kInterlacedTopFirst, Field::kInterlacedBottomFirst}) {
    for (const char* const pattern : {"0,dark", "dark,0"}) {
      testing::reseed();
      Street street;
      street.pattern = IlluminationPattern::parse(pattern);
      street.field = order;
      street.amplitude_dn = 0.0;
      street.noise_dn = 0.5;
      street.grain_px = 16.0;  // 1/16 cycles per row of a field and less.
      street.build();
      int frames = 0;
      for_each_lit(street, 4, [&](const LitFrame& lit) {
        EXPECT_EQ(lit.dark.size(), lit.lit.size());
        cv::Scalar mean;
        cv::Scalar deviation;
        cv::meanStdDev(residual_of(lit).rowRange(3, 117), mean, deviation);
        // The nearest row would leave several DN.
        EXPECT_LT(deviation[0], 0.8) << pattern;
        EXPECT_NEAR(mean[0], 0.0, 0.1) << pattern;
        EXPECT_NEAR(lit.dark_noise_gain, lit.sequence == 0 && lit.dark_noise_gain > 0.5 ? .64 : .32,
                    0.01);
        ++frames;
      });
      EXPECT_GE(frames, 3);
    }
  }
}

TEST(Subtraction, EdgesBetweenFieldRowsAreInTheVariance) {
  testing::reseed();
  Street street;
  street.field = Field::kInterlacedTopFirst;
  street.amplitude_dn = 0.0;
  street.texture_dn = 1.0;
  street.edge_dn = 60.0;
  street.build();
  for_each_lit(street, 5, [&](const LitFrame& lit) {
    const double pull = pull_deviation(lit, street.noise_dn);
    EXPECT_LT(pull, 1.15);
    EXPECT_GT(pull, 0.85);
  });
}

TEST(Subtraction, DarkFieldsOfTheSameRowsAreTakenDirectly) {
  testing::reseed();
  Street street;
  street.field = Field::kInterlacedTopFirst;
  street.pattern = IlluminationPattern::parse("0,dark,dark");
  street.amplitude_dn = 0.0;
  street.grain_px = 1.5;  // Too fine for any interpolation between rows.
  street.build();
  int frames = 0;
  for_each_lit(street, 7, [&](const LitFrame& lit) {
    if (lit.sequence == 0) return;
    cv::Scalar mean;
    cv::Scalar deviation;
    cv::meanStdDev(residual_of(lit), mean, deviation);
    EXPECT_LT(deviation[0], 1.35 * street.noise_dn);
    EXPECT_TRUE(lit.variance.empty());
    ++frames;
  });
  EXPECT_GE(frames, 3);
}

TEST(Subtraction, SixteenBitsAreTreatedTheSame) {
  testing::reseed();
  Street street;
  street.bit_depth = 12;
  street.daylight_dn = 2000.0;
  street.texture_dn = 300.0;
  street.noise_dn = 20.0;
  street.amplitude_dn = 0.0;
  for (const Field order : {Field::kProgressive, Field::kInterlacedTopFirst}) {
    street.field = order;
    street.grain_px = order == Field::kProgressive ? 3.0 : 16.0;
    street.build();
    for_each_lit(street, 5, [&](const LitFrame& lit) {
      EXPECT_EQ(lit.dark.type(), CV_16UC1);
      const double pull = pull_deviation(lit, street.noise_dn);
      EXPECT_NEAR(pull, 1.0, 0.1);
    });
  }
}

// ---- Masked spots.

TEST(Masked, LightSourceIsMaskedAndAFewPixelsAround) {
  testing::reseed();
  Street street;
  street.light_sources = {{100.0, 60.0, 6.0}};
  street.build();
  for_each_lit(street, 6, [&](const LitFrame& lit) {
    ASSERT_FALSE(lit.masked.empty());
    EXPECT_NE(lit.masked.at<std::uint8_t>(60, 100), 0);
    EXPECT_NE(lit.masked.at<std::uint8_t>(60 - 9, 100), 0);
    EXPECT_NE(lit.masked.at<std::uint8_t>(60 + 9, 100), 0);
    EXPECT_EQ(lit.masked.at<std::uint8_t>(60, 100 + 12), 0);
    EXPECT_EQ(lit.masked.at<std::uint8_t>(60 + 14, 100), 0);
    EXPECT_LT(cv::countNonZero(lit.masked), 500);
  });
}

TEST(Masked, LightSourceThatMovesIsMaskedWhereItIsInTheLitExposureToo) {
  testing::reseed();
  Street street;
  street.light_sources = {{250.0, 60.0, 5.0}};
  street.speed_px = 20.0;
  street.build();
  for_each_lit(street, 6, [&](const LitFrame& lit) {
    ASSERT_FALSE(lit.masked.empty());
    const int light_source = 250 - 20 * static_cast<int>(lit.sequence);
    EXPECT_NE(lit.masked.at<std::uint8_t>(60, light_source), 0) << lit.sequence;
  });
}

TEST(Masked, ClippedStripeIsNotMasked) {
  testing::reseed();
  Street street;
  street.amplitude_dn = 400.0;
  street.build();
  for_each_lit(street, 6, [&](const LitFrame& lit) { EXPECT_TRUE(lit.masked.empty()); });
}

TEST(Masked, ClippedStripeFarFromALightSourceIsNotMasked) {
  testing::reseed();
  Street street;
  street.amplitude_dn = 400.0;
  street.light_sources = {{100.0, 30.0, 6.0}};
  street.build();
  for_each_lit(street, 6, [&](const LitFrame& lit) {
    for (int u = 0; u < 320; ++u) {
      EXPECT_EQ(lit.masked.at<std::uint8_t>(static_cast<int>(street.row(0, u)), u), 0);
    }
  });
}

// ---- A static sensor.

TEST(Temporal, TakesOffWhatStandsStillAndKeepsWhatMoves) {
  testing::reseed();
  Street street;
  street.pattern = IlluminationPattern::parse("0");
  street.build();
  std::uint64_t now = 0;
  street.row = [&now](int, int) { return 40.0 + 12.0 * static_cast<double>(now); };
  AmbientOptions options;
  options.method = AmbientMethod::kTemporal;
  options.pattern = street.pattern;
  AmbientStage stage(options);
  int frames = 0;
  for (now = 0; now < 12; ++now) {
    stage.push(street.frame(now));
    while (const LitFrame* const lit = stage.next()) {
      const cv::Mat residual = residual_of(*lit);
      const int row = 40 + 12 * static_cast<int>(lit->sequence);
      EXPECT_GT(cv::mean(residual.row(row))[0], 0.7 * street.amplitude_dn);
      EXPECT_LT(cv::mean(cv::abs(residual.rowRange(0, 30)))[0], 3.0);
      ++frames;
    }
  }
  EXPECT_EQ(frames, 12);
  EXPECT_EQ(stage.status().method, AmbientMethod::kTemporal);
}

}  // namespace
}  // namespace striper
