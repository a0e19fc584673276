// SPDX-License-Identifier: Apache-2.0
// Proves how a stripe's elements are kept: where they are on the sensor for either axis, that what
// is missing has no number, and that a list of the same length costs no memory.
#include <cmath>

#include <gtest/gtest.h>

#include <striper/stripe/stripe.hpp>

#include "support/allocation_counter.hpp"

namespace striper {
namespace {

void expect_no_numbers(const Stripe& stripe, std::size_t i) {
  EXPECT_TRUE(std::isnan(stripe.across_px[i])) << i;
  EXPECT_TRUE(std::isnan(stripe.sigma_px[i])) << i;
  EXPECT_TRUE(std::isnan(stripe.amplitude_dn[i])) << i;
  EXPECT_TRUE(std::isnan(stripe.width_px[i])) << i;
  EXPECT_TRUE(std::isnan(stripe.confidence[i])) << i;
}

void fill(Stripe& stripe, std::size_t i) {
  stripe.across_px[i] = 100.25;
  stripe.sigma_px[i] = stripe.amplitude_dn[i] = stripe.width_px[i] = stripe.confidence[i] = 1.0F;
  stripe.status[i] = ReturnStatus::kOk;
}

TEST(Stripe, ResetMakesAnElementPerLineWithoutNumbers) {
  Stripe stripe;
  for (const int lines : {5, 3, 0}) {
    stripe.reset(7);
    fill(stripe, 0);
    stripe.reset(lines);
    EXPECT_EQ(stripe.line_count, lines);
    ASSERT_EQ(stripe.size(), static_cast<std::size_t>(lines));
    for (std::size_t i = 0; i < stripe.size(); ++i) {
      EXPECT_EQ(stripe.line[i], static_cast<int>(i));
      EXPECT_EQ(stripe.status[i], ReturnStatus::kNoStripe);
      expect_no_numbers(stripe, i);
    }
  }
}

TEST(Stripe, WhatIsDroppedKeepsItsLineAndTheReason) {
  Stripe stripe;
  stripe.reset(2);
  fill(stripe, 0);
  fill(stripe, 1);
  stripe.drop(1, ReturnStatus::kBlind);
  expect_no_numbers(stripe, 1);
  EXPECT_EQ(stripe.status[1], ReturnStatus::kBlind);
  EXPECT_EQ(stripe.line[1], 1);
  EXPECT_EQ(stripe.across_px[0], 100.25) << "the others stay";
}

TEST(Stripe, ALineMayHaveSeveralElements) {
  Stripe stripe;
  stripe.reset(3);
  stripe.clear();
  EXPECT_EQ(stripe.append(2), 0U);
  EXPECT_EQ(stripe.append(2), 1U);
  EXPECT_EQ(stripe.size(), 2U);
  EXPECT_EQ(stripe.line_count, 3) << "of the image";
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(stripe.line[i], 2);
    EXPECT_EQ(stripe.status[i], ReturnStatus::kNoStripe);
    expect_no_numbers(stripe, i);
  }
}

// A bottom field of a region: columns count one by one, rows two by two.
TEST(Stripe, PlacesAreThoseOfTheSensorAlongEitherAxis) {
  Stripe stripe;
  stripe.grid = PixelGrid::region(64, 32).then(PixelGrid::bottom_field());
  stripe.reset(4);
  stripe.across_px[3] = 200.5;
  EXPECT_EQ(stripe.u_px(3), 64.0 + 3.0);
  EXPECT_EQ(stripe.v_px(3), 200.5);
  EXPECT_EQ(stripe.half_pixel_px(), 1.0) << "half a line of a field is one row of the sensor";
  stripe.axis = StripeAxis::kRows;
  EXPECT_EQ(stripe.v_px(3), 32.0 + 1.0 + 2.0 * 3.0);
  EXPECT_EQ(stripe.u_px(3), 200.5);
  EXPECT_EQ(stripe.half_pixel_px(), 0.5);
}

TEST(Stripe, OfTheSameLengthCostsNoMemory) {
  Stripe stripe;
  stripe.reset(640);
  const testing::AllocationCounter allocations;
  for (int frame = 0; frame < 3; ++frame) {
    stripe.reset(640);
    stripe.clear();
    for (int line = 0; line < 640; ++line) stripe.append(line);
    stripe.resize(320);
  }
  EXPECT_EQ(allocations.count(), 0U);
}

}  // namespace
}  // namespace striper
