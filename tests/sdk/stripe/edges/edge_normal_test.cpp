// SPDX-License-Identifier: Apache-2.0
// Proves, for every instruction set, how a pixel is weighted, that the gradient is that which
// differences of chi squared tell and the information that of the gradient, that pixels add up
// however many there are, and that a clipped one tells nothing where the model exceeds it. Does not
// prove that the model is what a lens shows (edge_profile_test does), nor the information where
// residuals are large.
#include "stripe/edges/edge_normal.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <gtest/gtest.h>

#include "support/instruction_sets.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

constexpr double kStep = 1e-5;
constexpr double kScale2 = 9.0;  // Of Cauchy's distribution, off the stripe.

// Noise that does not depend on the light: then the gradient is that of chi squared itself.
PlanNoise even_noise() {
  PlanNoise noise;
  noise.model.read_noise_dn = 2.0;
  noise.model.dn_per_electron = 0.0;
  noise.model.black_level_dn = 4.0;
  noise.dark_noise_gain = 1.0;
  return noise;
}

EdgeModel any_model() {
  EdgeModel model;
  model.of = {12.3, 90.0, 0.6, 13.1, 55.0, 4.5, 0.5, 1.7, 0.2};
  return model;
}

EdgeProfile any_profile(std::size_t count, bool has_dark) {
  EdgeProfile profile;
  profile.has_dark = has_dark;
  profile.count = count;
  // What is beyond is not looked at.
  profile.clipped.fill(true);
  for (auto* values : {&profile.at, &profile.lit, &profile.dark, &profile.extra})
    values->fill(std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < count; ++i) {
    profile.at[i] = static_cast<double>(i);
    profile.lit[i] = testing::uniform(20.0, 160.0);
    profile.dark[i] = testing::uniform(10.0, 90.0);
    profile.clipped[i] = false;
    profile.extra[i] = testing::uniform(0.0, 3.0);
  }
  return profile;
}

double chi2_at(const EdgeProfile& profile, EdgeModel model, EdgeKind kind, std::size_t parameter,
               double step) {
  model.of[parameter] += step;
  return edge_normal(profile, even_noise(), model, kind).chi2;
}

TEST(EdgeNormal, HasTheDerivativesOfChiSquared) {
  testing::for_each_instruction_set([] {
    testing::reseed();
    for (const EdgeKind kind : {EdgeKind::kReflectance, EdgeKind::kShadow}) {
      for (const bool has_dark : {false, true}) {
        const EdgeProfile profile = any_profile(25, has_dark);
        const EdgeNormal normal = edge_normal(profile, even_noise(), any_model(), kind);
        for (std::size_t i = 0; i < EdgeModel::kCount; ++i) {
          const double difference = chi2_at(profile, any_model(), kind, i, kStep) -
                                    chi2_at(profile, any_model(), kind, i, -kStep);
          const double expected = -0.5 * difference / (2.0 * kStep);
          EXPECT_NEAR(normal.gradient[i], expected, 1e-3 * std::max(1.0, std::abs(expected)))
              << "parameter " << i;
        }
      }
    }
  });
}

// The profile that the model itself gives.
EdgeProfile profile_of(const EdgeModel& model, std::size_t count) {
  EdgeProfile profile = any_profile(count, false);
  const double variance = even_noise().model.variance_dn2(0.0);
  for (std::size_t i = 0; i < count; ++i) {
    EdgeProfile one = any_profile(1, false);
    one.at[0] = profile.at[i];
    one.lit[0] = one.extra[0] = profile.extra[i] = 0.0;
    // Chi squared of what is not there tells what is; the slope is about the profile's middle.
    const EdgeNormal normal = edge_normal(one, even_noise(), model, EdgeKind::kReflectance);
    const double r2 =
        normal.core_rows > 0 ? normal.chi2 : kScale2 * std::expm1(normal.chi2 / kScale2);
    const double of_slope = model.of[EdgeModel::kSlope] * (profile.at[i] - profile.at[count / 2]);
    profile.lit[i] = std::sqrt(r2 * variance) + of_slope;
  }
  return profile;
}

TEST(EdgeNormal, HasTheInformationOfItsDerivatives) {
  testing::for_each_instruction_set([] {
    testing::reseed();
    const EdgeModel model = any_model();
    const EdgeProfile profile = profile_of(model, 25);
    const auto normal_at = [&](const EdgeModel& at) {
      return edge_normal(profile, even_noise(), at, EdgeKind::kReflectance);
    };
    const EdgeNormal normal = normal_at(model);
    ASSERT_LT(normal.chi2, 1e-9);
    for (std::size_t i = 0; i < EdgeModel::kCount; ++i) {
      EdgeModel more = model;
      EdgeModel less = model;
      more.of[i] += kStep;
      less.of[i] -= kStep;
      const EdgeNormal after = normal_at(more);
      const EdgeNormal before = normal_at(less);
      for (std::size_t j = 0; j < EdgeModel::kCount; ++j) {
        const double expected = -(after.gradient[j] - before.gradient[j]) / (2.0 * kStep);
        const double found = normal.information[std::max(i, j)][std::min(i, j)];
        EXPECT_NEAR(found, expected, 1e-3 * std::max(1.0, std::abs(expected))) << i << " " << j;
      }
    }
  });
}

// A pixel without an edge: its chi squared is told by hand.
struct OnePixel {
  double x = 0.0;  // From the stripe's middle, pixels.
  double residual_dn = 0.0;
  double dark_residual_dn = 0.0;
};

EdgeProfile profile_of(const OnePixel& pixel, double background_dn, double laser_dn) {
  EdgeProfile profile = any_profile(1, true);
  profile.at[0] = 10.0 + pixel.x;
  profile.lit[0] = background_dn + laser_dn + pixel.residual_dn;
  profile.dark[0] = background_dn + pixel.dark_residual_dn;
  profile.extra[0] = 1.5;
  profile.clipped[0] = false;
  return profile;
}

TEST(EdgeNormal, WeighsByTheNoiseOfTheModelsLight) {
  constexpr double kAmbient = 50.0;
  constexpr double kPeak = 100.0;
  constexpr double kWidth2 = 4.0;  // With the pixel's box.
  EdgeModel model;
  model.of = {10.0, kPeak, 0.0, 10.0, kAmbient, 5.0, 0.5, std::sqrt(kWidth2 - 1.0 / 12.0), 0.0};
  PlanNoise noise;
  noise.model.read_noise_dn = 2.0;
  noise.model.dn_per_electron = 0.3;
  noise.model.black_level_dn = 5.0;
  noise.speckle_contrast = 0.2;
  const double floor = noise.model.variance_dn2(5.0);
  testing::for_each_instruction_set([&] {
    for (const double gain : {0.0, 0.3, 1.0}) {
      noise.dark_noise_gain = gain;
      for (const OnePixel& pixel : {OnePixel{0.5, 7.0, 3.0}, OnePixel{6.0, -4.0, 2.0}}) {
        const double laser = kPeak * std::exp(-0.5 * pixel.x * pixel.x / kWidth2);
        const double variance = floor + 0.3 * (kAmbient + laser) + 0.2 * 0.2 * laser * laser + 1.5;
        const double lit2 = pixel.residual_dn * pixel.residual_dn / variance;
        const double dark_variance = std::max(0.05, gain) * (floor + 0.3 * kAmbient);
        const double dark2 = pixel.dark_residual_dn * pixel.dark_residual_dn / dark_variance;
        const auto cauchy = [](double r2) { return kScale2 * std::log1p(r2 / kScale2); };
        const bool is_core = pixel.x < 5.0;
        const double expected = is_core ? lit2 + dark2 : cauchy(lit2) + cauchy(dark2);
        const EdgeNormal normal = edge_normal(profile_of(pixel, 5.0 + kAmbient, laser), noise,
                                              model, EdgeKind::kReflectance);
        EXPECT_NEAR(normal.chi2, expected, 1e-6 * expected) << gain << " " << pixel.x;
        EXPECT_EQ(normal.core_rows, is_core ? 2 : 0);
      }
    }
  });
}

TEST(EdgeNormal, IsTheSumOfItsPixels) {
  testing::for_each_instruction_set([] {
    testing::reseed();
    EdgeModel model = any_model();
    model.of[EdgeModel::kSlope] = 0.0;  // It is about the middle of the pixels.
    for (std::size_t count = 0; count <= EdgeProfile::kMost; ++count) {
      const EdgeProfile profile = any_profile(count, count % 2 == 0);
      const EdgeNormal all = edge_normal(profile, even_noise(), model, EdgeKind::kReflectance);
      EdgeNormal sum{};
      for (std::size_t i = 0; i < count; ++i) {
        EdgeProfile one = profile;
        one.count = 1;
        one.at[0] = profile.at[i];
        one.lit[0] = profile.lit[i];
        one.dark[0] = profile.dark[i];
        one.extra[0] = profile.extra[i];
        const EdgeNormal normal = edge_normal(one, even_noise(), model, EdgeKind::kReflectance);
        sum.chi2 += normal.chi2;
        sum.core_chi2 += normal.core_chi2;
        sum.rows += normal.rows;
        sum.core_rows += normal.core_rows;
        sum.gradient[EdgeModel::kPosition] += normal.gradient[EdgeModel::kPosition];
      }
      EXPECT_NEAR(all.chi2, sum.chi2, 1e-8 * std::max(1.0, sum.chi2)) << count;
      EXPECT_NEAR(all.core_chi2, sum.core_chi2, 1e-8 * std::max(1.0, sum.core_chi2)) << count;
      EXPECT_EQ(all.rows, sum.rows);
      EXPECT_EQ(all.core_rows, sum.core_rows);
      const double gradient = sum.gradient[EdgeModel::kPosition];
      EXPECT_NEAR(all.gradient[EdgeModel::kPosition], gradient,
                  1e-8 * std::max(1.0, std::abs(gradient)));
    }
  });
}

void expect_same(const EdgeNormal& a, const EdgeNormal& b) {
  EXPECT_NEAR(a.chi2, b.chi2, 1e-9 * std::max(1.0, b.chi2));
  EXPECT_EQ(a.rows, b.rows);
  EXPECT_EQ(a.core_rows, b.core_rows);
  for (std::size_t i = 0; i < EdgeModel::kCount; ++i) {
    EXPECT_NEAR(a.gradient[i], b.gradient[i], 1e-9 * std::max(1.0, std::abs(b.gradient[i])));
    for (std::size_t j = 0; j <= i; ++j) {
      const double expected = b.information[i][j];
      EXPECT_NEAR(a.information[i][j], expected, 1e-9 * std::max(1.0, std::abs(expected)));
    }
  }
}

TEST(EdgeNormal, AClippedPixelTellsNothingWhereTheModelExceedsIt) {
  constexpr std::size_t kPixel = 13;
  testing::for_each_instruction_set([] {
    testing::reseed();
    EdgeModel model = any_model();
    model.of[EdgeModel::kSlope] = 0.0;  // It is about the middle of the pixels.
    const auto normal_of = [&](const EdgeProfile& profile) {
      return edge_normal(profile, even_noise(), model, EdgeKind::kReflectance);
    };
    const EdgeProfile whole = any_profile(25, false);
    EdgeProfile without = whole;
    for (std::size_t i = kPixel; i + 1 < whole.count; ++i) {
      without.at[i] = whole.at[i + 1];
      without.lit[i] = whole.lit[i + 1];
      without.extra[i] = whole.extra[i + 1];
    }
    --without.count;
    EdgeProfile clipped = whole;
    clipped.is_clipped = true;
    clipped.clipped[kPixel] = true;
    clipped.lit[kPixel] = 10.0;  // The model has more.
    EdgeNormal told = normal_of(clipped);
    EdgeNormal expected = normal_of(without);
    for (EdgeNormal* normal : {&told, &expected}) {  // The slope's part is about another middle.
      normal->gradient[EdgeModel::kSlope] = 0.0;
      normal->information[EdgeModel::kSlope].fill(0.0);
    }
    expect_same(told, expected);
    clipped.lit[kPixel] = 1000.0;
    EdgeProfile above = clipped;
    above.is_clipped = false;
    expect_same(normal_of(clipped), normal_of(above));
  });
}

}  // namespace
}  // namespace striper::detail
