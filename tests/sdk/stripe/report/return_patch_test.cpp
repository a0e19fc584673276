// SPDX-License-Identifier: Apache-2.0
// Proves what a patch has of the image about a return: pixels above their median in heights of the
// return, nothing beyond the image's borders, where returns are and how they were rated; the same
// of a turned image and of one of more bits. Proves of the network that it is what its weights make
// of it by plain sums, whatever the instruction set; and of the patches that one serves the returns
// next to the one that it was made about, no others. That the network tells more than what was
// known before is proven in patch_rating_test.cpp.
#include "stripe/report/patches/return_patch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "stripe/report/line_odds.hpp"
#include "stripe/report/patches/patch_net.hpp"
#include "stripe/report/patches/rated_patches.hpp"
#include "support/instruction_sets.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

#include "stripe/report/patches/patch_net.inc"

using striper::testing::uniform;

constexpr int kLines = 60;
constexpr int kLength = 80;
constexpr int kStripe = 40;
constexpr std::size_t kMiddle = ReturnPatch::kSide / 2;
constexpr int kGround_dn = 20;
constexpr int kHeight_dn = 100;

// A stripe of one pixel's width along a row, all of whose returns are found.
struct StripeAlongARow {
  LitFrame frame;
  Stripe stripe;
  std::vector<float> odds = std::vector<float>(kLines, 2.5F);
  ReturnPatch patch{};

  StripeAlongARow() {
    frame.lit = cv::Mat(kLength, kLines, CV_8UC1, cv::Scalar(kGround_dn));
    frame.lit.row(kStripe).setTo(kGround_dn + kHeight_dn);
    frame.full_scale_dn = 255;
    stripe.reset(kLines);
    for (std::size_t line = 0; line < kLines; ++line) {
      stripe.across_px[line] = kStripe;
      stripe.amplitude_dn[line] = kHeight_dn;
    }
  }

  RatedFrame rated() const { return {frame, stripe, odds}; }
  float at(ReturnPatch::Plane plane, std::size_t across, std::size_t along) {
    return patch.row(plane, across)[along];
  }
};

TEST(ReturnPatch, HasTheImageAboveItsMedianInHeightsOfTheReturn) {
  StripeAlongARow s;
  s.frame.lit.at<std::uint8_t>(kStripe - 3, 30) = kGround_dn - 10;
  look_about(s.rated(), 28, s.patch);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, kMiddle, kMiddle), 1.0F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, kMiddle + 1, kMiddle), 0.0F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, kMiddle - 3, kMiddle + 2), -0.1F);
}

TEST(ReturnPatch, HasNothingBeyondTheImage) {
  StripeAlongARow s;
  look_about(s.rated(), 5, s.patch);
  const std::size_t first = kMiddle - 5;
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, kMiddle, first), 1.0F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, kMiddle, first - 1), 0.0F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kReturn, kMiddle, first), 1.0F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kReturn, kMiddle, first - 1), 0.0F);
}

TEST(ReturnPatch, HasNothingBeyondTheEndsOfAScanLine) {
  for (const int at : {3, kLength - 4}) {
    StripeAlongARow s;
    s.frame.lit.setTo(150);
    s.frame.lit.row(at).setTo(200);
    s.frame.lit.row(at < kStripe ? 0 : kLength - 1).setTo(170);
    for (double& position : s.stripe.across_px) position = at;
    s.stripe.across_px[30] = at < kStripe ? -0.5 : kLength - 0.5;
    look_about(s.rated(), 28, s.patch);
    const std::size_t beyond = at < kStripe ? kMiddle - 4 : kMiddle + 4;
    EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, kMiddle, kMiddle), 0.5F);
    EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, beyond, kMiddle), 0.0F);
    EXPECT_FLOAT_EQ(s.at(ReturnPatch::kReturn, beyond, kMiddle + 2), 0.0F);
  }
}

TEST(ReturnPatch, HasNothingThatIsFarBrighterOrDarker) {
  StripeAlongARow s;
  s.frame.lit.setTo(100);
  s.frame.lit.at<std::uint8_t>(kStripe, 28) = 255;
  s.frame.lit.at<std::uint8_t>(kStripe, 29) = 0;
  for (float& height : s.stripe.amplitude_dn) height = 20.0F;
  look_about(s.rated(), 28, s.patch);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, kMiddle, kMiddle), 4.0F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, kMiddle, kMiddle + 1), -3.0F);
  s.stripe.amplitude_dn[28] = 0.0F;
  look_about(s.rated(), 28, s.patch);
  EXPECT_TRUE(std::isfinite(s.at(ReturnPatch::kImage, kMiddle + 1, kMiddle)));
}

TEST(ReturnPatch, HasWhereReturnsAreAndHowTheyWereRated) {
  StripeAlongARow s;
  s.stripe.across_px[30] = kStripe + 4.25;
  s.odds[30] = -5.0F;
  s.odds[31] = kNoReturn;
  look_about(s.rated(), 28, s.patch);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kReturn, kMiddle, kMiddle), 1.0F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kRated, kMiddle, kMiddle), 0.5F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kReturn, kMiddle + 4, kMiddle + 2), 0.75F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kReturn, kMiddle + 5, kMiddle + 2), 0.25F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kRated, kMiddle + 4, kMiddle + 2), -0.75F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kReturn, kMiddle, kMiddle + 3), 0.0F);
}

TEST(ReturnPatch, IsOfTheImageWhereverThatIsOnTheSensor) {
  StripeAlongARow s;
  s.frame.grid.v = {10.0, 2.0};
  for (double& position : s.stripe.across_px) position = 10.0 + 2.0 * kStripe;
  look_about(s.rated(), 28, s.patch);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kImage, kMiddle, kMiddle), 1.0F);
  EXPECT_FLOAT_EQ(s.at(ReturnPatch::kReturn, kMiddle, kMiddle), 1.0F);
}

TEST(ReturnPatch, IsTheSameOfATurnedImageAndOfMoreBits) {
  StripeAlongARow s;
  testing::reseed();
  for (int row = 0; row < kStripe; ++row) {
    for (int column = 0; column < kLines; ++column) {
      s.frame.lit.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(uniform(0.0, 150.0));
    }
  }
  look_about(s.rated(), 28, s.patch);
  const ReturnPatch before = s.patch;
  StripeAlongARow other;
  other.frame.lit = s.frame.lit.t();
  other.stripe.axis = StripeAxis::kRows;
  look_about(other.rated(), 28, other.patch);
  EXPECT_EQ(before.of, other.patch.of);
  s.frame.lit.convertTo(s.frame.lit, CV_16U, 16.0);
  s.frame.full_scale_dn = 16 * 255;
  for (float& height : s.stripe.amplitude_dn) height *= 16.0F;
  look_about(s.rated(), 28, s.patch);
  EXPECT_EQ(before.of, s.patch.of);
}

// What the weights make of a patch, sum by sum.
std::vector<float> filtered(const std::vector<float>& in, std::size_t inputs, std::size_t wide,
                            const float* weights, const float* biases, std::size_t outputs) {
  const auto side = static_cast<int>(wide);
  std::vector<float> out(outputs * wide * wide / 4, 0.0F);
  for (std::size_t o = 0; o < outputs; ++o) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        float sum = biases[o];
        for (std::size_t i = 0; i < inputs; ++i) {
          for (int k = 0; k < 9; ++k) {
            const int v = y + k / 3 - 1;
            const int u = x + k % 3 - 1;
            if (v < 0 || v >= side || u < 0 || u >= side) continue;
            const std::size_t weight =
                ((o / 4 * inputs + i) * 9 + static_cast<std::size_t>(k)) * 4 + o % 4;
            sum +=
                in[(i * wide + static_cast<std::size_t>(v)) * wide + static_cast<std::size_t>(u)] *
                weights[weight];
          }
        }
        float& most = out[(o * wide / 2 + static_cast<std::size_t>(y / 2)) * wide / 2 +
                          static_cast<std::size_t>(x / 2)];
        most = std::max(most, sum);
      }
    }
  }
  return out;
}

std::vector<float> weighed(const std::vector<float>& in, const float* weights, const float* biases,
                           std::size_t outputs) {
  std::vector<float> out(biases, biases + outputs);
  for (std::size_t i = 0; i < in.size(); ++i) {
    for (std::size_t o = 0; o < outputs; ++o) out[o] += in[i] * weights[i * outputs + o];
  }
  for (float& value : out) value = std::max(0.0F, value);
  return out;
}

TEST(PatchNet, IsWhatItsWeightsMakeOfAPatch) {
  testing::reseed();
  ReturnPatch patch{};
  for (float& value : patch.of) value = static_cast<float>(uniform(-1.0, 2.0));
  Evidence evidence;
  for (float& value : evidence.of) value = static_cast<float>(uniform(-3.0, 3.0));
  evidence.of[Evidence::kCount - 1] = 40.0F;  // More than it learnt of: as much as there was.
  std::vector<float> shown(patch.of.begin(), patch.of.end());
  shown = filtered(shown, 3, 32, kFirstWeights, kFirstBiases, 8);
  shown = filtered(shown, 8, 16, kSecondWeights, kSecondBiases, 16);
  shown = filtered(shown, 16, 8, kThirdWeights, kThirdBiases, 16);
  std::vector<float> both = weighed(shown, kSeenWeights, kSeenBiases, PatchNet::kSeen);
  std::vector<float> known(evidence.of.begin(), evidence.of.end());
  known.back() = 16.0F;
  known.insert(known.end(), {1.5F / 3.0F, 2.0F / 4.0F, -1.0F / 3.0F, 0.25F});
  const std::vector<float> of_known = weighed(known, kKnownWeights, kKnownBiases, 48);
  both.insert(both.end(), of_known.begin(), of_known.end());
  const std::vector<float> hidden = weighed(both, kBothWeights, kBothBiases, 48);
  float more = kLastBias;
  for (std::size_t n = 0; n < hidden.size(); ++n) more += hidden[n] * kLastWeights[n];

  testing::for_each_instruction_set([&] {
    PatchNet::Seen seen{};
    PatchNet::look(patch, seen);
    for (std::size_t n = 0; n < seen.size(); ++n) {
      EXPECT_NEAR(seen[n], both[n], 1e-4F * (1.0F + both[n])) << n;
    }
    const float is = PatchNet::more_log_odds(seen, {2.0F, -1.0F, 0.25F}, evidence, 1.5F);
    EXPECT_NEAR(is, more, 1e-4F * (1.0F + std::abs(more)));
  });
}

TEST(RatedPatches, ServeWhatIsNextToThem) {
  StripeAlongARow s;
  s.stripe.across_px[22] = kStripe + 3.5;
  s.stripe.across_px[23] = kStripe + 3.0;
  RatedPatches patches(s.rated());
  EXPECT_TRUE(patches.look_at(10));
  EXPECT_FALSE(patches.look_at(12));
  EXPECT_FLOAT_EQ(patches.place().along, 2.0F);
  EXPECT_FALSE(patches.look_at(14));
  EXPECT_TRUE(patches.look_at(15)) << "five scan lines on";
  EXPECT_TRUE(patches.look_at(20));
  EXPECT_TRUE(patches.look_at(22)) << "too far across";
  EXPECT_FALSE(patches.look_at(23));
  EXPECT_FLOAT_EQ(patches.place().across, -0.5F);
  EXPECT_FLOAT_EQ(patches.place().fraction, -0.5F) << "43.5 is in pixel 44";
}

TEST(RatedPatches, LookAtWhatIsDoubted) {
  EXPECT_TRUE(RatedPatches::is_doubted(0.0F));
  EXPECT_TRUE(RatedPatches::is_doubted(std::log(99.0F)));
  EXPECT_FALSE(RatedPatches::is_doubted(kNoReturn));
  EXPECT_FALSE(RatedPatches::is_doubted(8.0F));
}

}  // namespace
}  // namespace striper::detail
