// SPDX-License-Identifier: Apache-2.0
// Proves that PieceScatter says by how much positions lie off their piece beyond their noise.
#include "stripe/select/piece_scatter.hpp"

#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "support/allocation_counter.hpp"
#include "support/peaks_of_a_frame.hpp"

namespace striper::detail {
namespace {

using testing::PeaksOfAFrame;

constexpr int kLines = 60;
constexpr std::size_t kMiddle = 30;
constexpr float kNoise = PeaksOfAFrame::kSigma * PeaksOfAFrame::kSigma;
// Of what lies off the line through two others, its position's share.
constexpr float kPerPosition = 1.0F / 1.5F;

PeaksOfAFrame frame_of(const std::function<double(int line)>& across) {
  std::vector<testing::Peak> peaks;
  for (int line = 0; line < kLines; ++line) peaks.push_back({line, across(line)});
  return {kLines, peaks};
}

std::vector<float> scatter_of(const std::function<double(int line)>& across) {
  const PeaksOfAFrame frame = frame_of(across);
  PieceScatter scatter;
  scatter.measure(frame.pieces());
  return scatter.px();
}

TEST(PieceScatter, AStraightObliquePieceHasNone) {
  EXPECT_EQ(scatter_of([](int line) { return 100.0 + 0.25 * line; }), std::vector<float>(kLines));
}

TEST(PieceScatter, ARoughPieceHasThatOfItsPositions) {
  const std::vector<float> px = scatter_of([](int line) { return 100.0 + (line % 4 < 2 ? 1 : 0); });
  EXPECT_NEAR(px[kMiddle], std::sqrt(kPerPosition - kNoise), 0.01F);
  EXPECT_NEAR(px.front(), px[kMiddle], 0.2F);
  EXPECT_NEAR(px.back(), px[kMiddle], 0.2F);
}

TEST(PieceScatter, OnePositionOffCountsBeyondThreeSigmas) {
  const auto off_by = [](double sigmas) {
    return scatter_of([=](int line) {
      return 100.0 + (line == kMiddle ? sigmas * PeaksOfAFrame::kSigma : 0.0);
    })[kMiddle];
  };
  EXPECT_EQ(off_by(2.0), 0.0F);
  EXPECT_NEAR(off_by(8.0), PeaksOfAFrame::kSigma * std::sqrt(64.0F * kPerPosition - 1.0F), 0.01F);
}

TEST(PieceScatter, IsForgottenFarAway) {
  const std::vector<float> px =
      scatter_of([](int line) { return 100.0 + (line < 20 && line % 4 < 2 ? 1.0 : 0.0); });
  EXPECT_GT(px[10], 0.5F);
  EXPECT_EQ(px.back(), 0.0F);
}

TEST(PieceScatter, AllocatesNothingOnceThereIsRoom) {
  const PeaksOfAFrame frame = frame_of([](int line) { return 100.0 + line % 3; });
  PieceScatter scatter;
  scatter.reserve(frame.pieces().size());
  const testing::AllocationCounter counter;
  scatter.measure(frame.pieces());
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper::detail
