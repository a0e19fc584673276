// SPDX-License-Identifier: Apache-2.0
// Proves, for every instruction set, that the derivatives of chi squared are those that differences
// of it tell, that pixels add up however many there are, and what a clipped one tells. That the
// model is what a lens shows is edge_profile_test's.
#include "stripe/edges/edge_normal.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <gtest/gtest.h>

#include "support/instruction_sets.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

constexpr double kStep = 1e-5;

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
EdgeProfile profile_of(const EdgeModel& model, EdgeKind kind, std::size_t count) {
  EdgeProfile profile = any_profile(count, false);
  const double variance = even_noise().model.variance_dn2(0.0);
  for (std::size_t i = 0; i < count; ++i) {
    EdgeProfile one = any_profile(1, false);
    one.at[0] = profile.at[i];
    one.lit[0] = one.extra[0] = profile.extra[i] = 0.0;
    // Chi squared of what is not there tells what is; the slope is about the profile's middle.
    const EdgeNormal normal = edge_normal(one, even_noise(), model, kind);
    const double r2 = normal.core_rows > 0 ? normal.chi2 : 9.0 * std::expm1(normal.chi2 / 9.0);
    const double of_slope = model.of[EdgeModel::kSlope] * (profile.at[i] - profile.at[count / 2]);
    profile.lit[i] = std::sqrt(r2 * variance) + of_slope;
  }
  return profile;
}

TEST(EdgeNormal, HasTheInformationOfItsDerivatives) {
  testing::for_each_instruction_set([] {
    testing::reseed();
    const EdgeModel model = any_model();
    const EdgeProfile profile = profile_of(model, EdgeKind::kReflectance, 25);
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

TEST(EdgeNormal, AClippedPixelTellsOnlyThatTheModelIsNotBelow) {
  testing::for_each_instruction_set([] {
    testing::reseed();
    EdgeProfile profile = any_profile(25, false);
    const auto rows = [&] {
      return edge_normal(profile, even_noise(), any_model(), EdgeKind::kReflectance).rows;
    };
    ASSERT_EQ(rows(), 25);
    profile.is_clipped = true;
    profile.clipped[13] = true;
    profile.lit[13] = 10.0;  // The model has more.
    EXPECT_EQ(rows(), 24);
    profile.lit[13] = 1000.0;
    EXPECT_EQ(rows(), 25);
  });
}

}  // namespace
}  // namespace striper::detail
