// SPDX-License-Identifier: Apache-2.0
// Proves of which candidates MeanAbout takes the mean: those of the piece, on both sides alike, the
// nearer ones more, never the candidate itself.
#include "stripe/select/evidence/mean_about.hpp"

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "support/allocation_counter.hpp"
#include "support/peaks_of_a_frame.hpp"

namespace striper::detail {
namespace {

constexpr float kNone = -7.0F;
constexpr std::size_t kLines = 9;

class OneLine : public ::testing::Test {
 protected:
  std::vector<float> means_of(const std::vector<float>& values) {
    std::vector<float> means;
    mean_.find(frame_.pieces(), values, kNone, means);
    return means;
  }

  static std::vector<testing::Peak> line() {
    std::vector<testing::Peak> peaks;
    for (std::size_t i = 0; i < kLines; ++i) peaks.push_back({static_cast<int>(i), 40.0});
    return peaks;
  }

  testing::PeaksOfAFrame frame_{static_cast<int>(kLines), line()};
  MeanAbout mean_;
};

TEST_F(OneLine, OfTheSameValueIsThatValue) {
  const std::vector<float> values(kLines, 3.0F);
  EXPECT_EQ(means_of(values), values);
}

TEST_F(OneLine, LeavesTheCandidateItselfOut) {
  std::vector<float> values(kLines, 1.0F);
  values[4] = 100.0F;
  const std::vector<float> means = means_of(values);
  EXPECT_EQ(means[4], 1.0F);
  EXPECT_GT(means[3], means[2]);
  EXPECT_GT(means[2], means[1]);
  EXPECT_GT(means[1], 1.0F);
  EXPECT_EQ(means[3], means[5]);
}

// Half of what is before it, half of what comes after it.
TEST_F(OneLine, HearsBothSidesAlike) {
  std::vector<float> values(kLines, 0.0F);
  for (std::size_t i = 0; i < 6; ++i) values[i] = 10.0F;
  EXPECT_NEAR(means_of(values)[6], 5.0F, 1e-5F);
}

TEST_F(OneLine, HasOneSideAtItsEnds) {
  std::vector<float> values(kLines, 2.0F);
  values.front() = -1.0F;
  EXPECT_EQ(means_of(values).front(), 2.0F);
}

TEST_F(OneLine, AllocatesNothingOnceThereIsRoom) {
  const std::vector<float> values(kLines, 1.0F);
  std::vector<float> means(kLines);
  mean_.reserve(frame_.pieces().size());
  const testing::AllocationCounter counter;
  mean_.find(frame_.pieces(), values, kNone, means);
  EXPECT_EQ(counter.count(), 0U);
}

TEST(MeanAbout, NothingIsAboutAPeakAlone) {
  const testing::PeaksOfAFrame frame(5, {{2, 40.0}});
  std::vector<float> means;
  MeanAbout().find(frame.pieces(), {1.0F}, kNone, means);
  EXPECT_EQ(means, std::vector<float>{kNone});
}

TEST(MeanAbout, OtherPiecesAreNotHeard) {
  std::vector<testing::Peak> peaks;
  std::vector<float> values;
  for (int line = 0; line < 6; ++line) {
    peaks.push_back({line, 20.0});
    peaks.push_back({line, 80.0});
    values.insert(values.end(), {1.0F, 5.0F});
  }
  const testing::PeaksOfAFrame frame(6, peaks);
  std::vector<float> means;
  MeanAbout().find(frame.pieces(), values, kNone, means);
  EXPECT_EQ(means, values);
}

}  // namespace
}  // namespace striper::detail
