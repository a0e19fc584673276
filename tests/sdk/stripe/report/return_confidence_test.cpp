// SPDX-License-Identifier: Apache-2.0
// Proves what a return's probability is found from once it was measured: its error, how far an edge
// moved it, what lies beside it, the same in a part of an image as in the whole; that what the
// image shows about doubted returns changes it where it is known what the stripe looks like, and
// only there; that it decides the status; that what is said to be sure is right on a board across
// which a stripe runs; and that no memory is allocated per frame. How often what is sure is right
// in scenes and real images is proven in stripe_choice_test.cpp and real_choice_test.cpp.
#include "stripe/report/return_confidence.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "stripe/profile_extractor.hpp"
#include "stripe/report/patches/rated_patches.hpp"
#include "support/allocation_counter.hpp"
#include "support/board_under_stripe.hpp"

namespace striper::detail {
namespace {

// Blurred by little more than the pixels.
constexpr testing::BoardUnderStripe kBoard{.lines = 320,
                                           .length_px = 340,
                                           .square_px = 37.0,
                                           .turn = 0.15,
                                           .origin_px = 148.0,
                                           .first_px = 150.0,
                                           .slope = 0.11,
                                           .width_px = 1.6,
                                           .white_dn = 120.0,
                                           .stripe_dn = 110.0,
                                           .black = 0.12,
                                           .blur_px = 1.4,
                                           .parts = 5,
                                           .noise_dn = 1.0};
constexpr int kLines = kBoard.lines;

double stripe_at(int line) { return testing::stripe_at(kBoard, line); }

ExtractOptions options_of(std::optional<double> around_px) {
  ExtractOptions options;
  options.stripe_sigma_px = kBoard.width_px;
  options.can_explain = true;
  if (!around_px) return options;
  ExpectedStripe expected;
  for (int line = 0; line < kLines; ++line) {
    expected.first_px.push_back(static_cast<float>(stripe_at(line) - *around_px));
    expected.last_px.push_back(static_cast<float>(stripe_at(line) + *around_px));
  }
  options.expected = {expected};
  return options;
}

class OnABoard : public ::testing::Test {
 protected:
  explicit OnABoard(std::optional<double> around_px = std::nullopt)
      : extractor_(options_of(around_px)) {
    frame_.lit = testing::draw(kBoard);
    frame_.full_scale_dn = 255;
    extractor_.extract(frame_, stripe_);
  }

  bool is_chosen(int line) const {
    const auto i = static_cast<std::size_t>(line);
    const bool is_any = extractor_.choice().of_line(line).candidate >= 0;
    return is_any && std::isfinite(stripe_.across_px[i]) && !extractor_.is_bridged(line);
  }
  const Candidate& chosen(int line) const {
    const std::int32_t candidate = extractor_.choice().of_line(line).candidate;
    return extractor_.choice().pieces().candidate(static_cast<std::size_t>(candidate));
  }
  // What lies beside a return is looked at before gaps are bridged.
  bool is_near_a_bridge(int line) const {
    for (int other = std::max(0, line - 6); other <= std::min(kLines - 1, line + 6); ++other) {
      if (extractor_.is_bridged(other)) return true;
    }
    return false;
  }
  float evidence(int line, Evidence::Kind kind) const {
    return extractor_.evidence(stripe_, line).of[kind];
  }
  double error(int line) const {
    return stripe_.across_px[static_cast<std::size_t>(line)] - stripe_at(line);
  }

  LitFrame frame_;
  ProfileExtractor extractor_;
  Stripe stripe_;
};

class InAPart : public OnABoard {
 protected:
  InAPart() : OnABoard(40.0) {}
};

// As a model tells it.
ExtractOptions options_of_known_look(float height_dn) {
  ExtractOptions options = options_of(40.0);
  options.expected.front().sigma_px = kBoard.width_px;
  options.expected.front().amplitude_dn.assign(static_cast<std::size_t>(kBoard.length_px),
                                               height_dn);
  return options;
}

int count_doubted(const ProfileExtractor& extractor) {
  const std::vector<float>& odds = extractor.confidence().among_others();
  return static_cast<int>(std::count_if(odds.begin(), odds.end(), RatedPatches::is_doubted));
}

using ReturnConfidenceOnABoard = OnABoard;
using ReturnConfidenceInAPart = InAPart;

TEST_F(ReturnConfidenceOnABoard, IsFoundFromHowAReturnWasMeasured) {
  ASSERT_FALSE(extractor_.choice().is_plain());
  int moved = 0;
  int edges = 0;
  for (int line = 0; line < kLines; ++line) {
    if (!is_chosen(line)) continue;
    const auto i = static_cast<std::size_t>(line);
    EXPECT_NEAR(std::exp2(evidence(line, Evidence::kReturnSigma)), stripe_.sigma_px[i],
                0.02 * stripe_.sigma_px[i]);
    EXPECT_GE(evidence(line, Evidence::kReturnWidened), -0.18F);  // Nine tenths of the noise.
    moved += static_cast<int>(std::abs(evidence(line, Evidence::kReturnMoved)) > 0.1F);
    edges += static_cast<int>(evidence(line, Evidence::kEdgeGain) > 4.0F);
  }
  EXPECT_GT(moved, kLines / 20);
  EXPECT_LT(moved, kLines / 2);
  EXPECT_GE(edges, moved);
  EXPECT_LT(edges, kLines * 3 / 4);
}

TEST_F(ReturnConfidenceInAPart, IsFoundFromTheSame) {
  ASSERT_GT(extractor_.searched_from_px(), 0);
  int moved = 0;
  for (int line = 0; line < kLines; ++line) {
    if (!is_chosen(line)) continue;
    const float by_widths = evidence(line, Evidence::kReturnMoved);
    EXPECT_LT(std::abs(by_widths), 3.0F) << line;
    moved += static_cast<int>(std::abs(by_widths) > 0.1F);
  }
  EXPECT_GT(moved, kLines / 20);
  EXPECT_LT(moved, kLines / 2);
}

TEST_F(ReturnConfidenceOnABoard, KnowsWhatStandsOffThoseBesideIt) {
  constexpr int kMoved = 150;
  ASSERT_TRUE(is_chosen(kMoved));
  const float before = evidence(kMoved, Evidence::kReturnOffNear);
  stripe_.across_px[kMoved] += 6.0;
  EXPECT_GT(evidence(kMoved, Evidence::kReturnOffNear), std::max(1.0F, before));
  stripe_.across_px[kMoved - 2] = std::nan("");
  EXPECT_EQ(evidence(kMoved, Evidence::kReturnOffNear), Evidence::kUnknown);
}

TEST_F(ReturnConfidenceOnABoard, IsWhatTheFifthForestSaysByThoseAboutIt) {
  int rated = 0;
  for (int line = 0; line < kLines; ++line) {
    if (!is_chosen(line) || is_near_a_bridge(line)) continue;
    const Candidate& candidate = chosen(line);
    const Evidence e = extractor_.evidence(stripe_, line);
    EXPECT_NEAR(e.of[Evidence::kFourth],
                std::clamp(weigh(fourth_forest(), e), kNoReturn, kMostLogOdds), 0.02F);
    const float odds = std::min(kMostLogOdds, weigh(fifth_forest(), e));
    const float expected = std::min(candidate.list->confidence[candidate.at], logistic(odds));
    EXPECT_NEAR(stripe_.confidence[static_cast<std::size_t>(line)], expected, 1e-4F) << line;
    ++rated;
  }
  EXPECT_GT(rated, kLines / 2);
}

TEST_F(ReturnConfidenceOnABoard, IsWhatAnExplanationSays) {
  int explained = 0;
  for (int line = 0; line < kLines; line += 7) {
    if (!is_chosen(line)) continue;
    for (const LineCandidate& candidate : extractor_.explain(line).candidates) {
      if (candidate.fate != CandidateFate::kChosen) continue;
      ++explained;
      const auto i = static_cast<std::size_t>(line);
      EXPECT_GE(candidate.probability + 1e-6, static_cast<double>(stripe_.confidence[i])) << line;
      EXPECT_LT(candidate.probability, static_cast<double>(stripe_.confidence[i]) + 0.01) << line;
    }
  }
  EXPECT_GT(explained, kLines / 14);
}

TEST_F(ReturnConfidenceOnABoard, IsTheSameWhateverIsAskedOfIt) {
  for (const double least : {0.0, 0.5, 0.999}) {
    ExtractOptions options = options_of(std::nullopt);
    options.min_confidence = least;
    ProfileExtractor extractor(options);
    Stripe stripe;
    extractor.extract(frame_, stripe);
    for (int line = 0; line < kLines; ++line) {
      if (!is_chosen(line)) continue;
      const auto i = static_cast<std::size_t>(line);
      EXPECT_EQ(stripe.confidence[i], stripe_.confidence[i]) << line;
      EXPECT_EQ(stripe.sigma_px[i], stripe_.sigma_px[i]) << line;
    }
  }
}

// Bridged or not.
TEST_F(ReturnConfidenceOnABoard, IsHighOnlyWhereAReturnIsRight) {
  int sure = 0;
  for (int line = 0; line < kLines; ++line) {
    const auto i = static_cast<std::size_t>(line);
    if (!(stripe_.confidence[i] >= 0.99F)) continue;
    ++sure;
    const double right = std::max(0.5, 3.0 * static_cast<double>(stripe_.sigma_px[i]));
    EXPECT_LT(std::abs(error(line)), right) << line;
  }
  EXPECT_GT(sure, kLines / 2);
}

TEST_F(ReturnConfidenceOnABoard, GivesTheStatus) {
  ASSERT_TRUE(stripe_.is_seen);
  int other = 0;  // Than what the candidates alone tell.
  for (int line = 0; line < kLines; ++line) {
    const auto i = static_cast<std::size_t>(line);
    const ReturnStatus status = stripe_.status[i];
    const bool is_sure = stripe_.confidence[i] >= 0.99F;
    EXPECT_FALSE(status == ReturnStatus::kOk && !is_sure) << line;
    EXPECT_FALSE(status == ReturnStatus::kOutlier && is_sure) << line;
    if (!is_chosen(line)) continue;
    other += static_cast<int>(is_sure != (extractor_.choice().of_line(line).confidence >= 0.99F));
  }
  EXPECT_GT(other, 0);
}

TEST_F(ReturnConfidenceOnABoard, IsFoundFromTheImageAboutWhatIsDoubtedWhereTheLookIsKnown) {
  ProfileExtractor extractor(options_of_known_look(kBoard.stripe_dn));
  extractor.extract(frame_, stripe_);
  ASSERT_GT(extractor.searched_from_px(), 0);
  const std::vector<float>& before = extractor.confidence().among_others();
  int changed = 0;
  for (std::size_t line = 0; line < kLines; ++line) {
    const std::optional<float> now = extractor.confidence().of_line(line);
    if (!now) continue;
    const bool is_other = std::abs(*now - logistic(before[line])) > 1e-6F;
    EXPECT_TRUE(!is_other || RatedPatches::is_doubted(before[line])) << line;
    changed += static_cast<int>(is_other);
  }
  EXPECT_GT(changed, 0);
  EXPECT_GT(10 * changed, 9 * count_doubted(extractor));
}

TEST_F(ReturnConfidenceOnABoard, IsNotFoundFromTheImageWhereTheLookIsUnknown) {
  EXPECT_EQ(count_doubted(extractor_), 0) << "no model";
  ProfileExtractor dark(options_of_known_look(0.0F));
  dark.extract(frame_, stripe_);
  EXPECT_EQ(count_doubted(dark), 0) << "no height is known";
  ProfileExtractor other(options_of_known_look(kBoard.stripe_dn));
  frame_.laser = 1;
  other.extract(frame_, stripe_);
  EXPECT_EQ(count_doubted(other), 0) << "of another laser";
}

TEST_F(ReturnConfidenceOnABoard, IsNotFoundFromTheImageWhereHardlyAnythingIsSure) {
  testing::BoardUnderStripe faint = kBoard;
  faint.stripe_dn = 6.0;
  frame_.lit = testing::draw(faint);
  ProfileExtractor extractor(options_of_known_look(6.0F));
  extractor.extract(frame_, stripe_);
  ASSERT_GT(count_doubted(extractor), 0);
  const std::vector<float>& before = extractor.confidence().among_others();
  for (std::size_t line = 0; line < kLines; ++line) {
    const std::optional<float> now = extractor.confidence().of_line(line);
    if (!now) continue;
    EXPECT_EQ(*now, logistic(before[line])) << line;
  }
}

TEST_F(ReturnConfidenceOnABoard, LooksAtTheImageWithoutAllocatingPerFrame) {
  ProfileExtractor extractor(options_of_known_look(kBoard.stripe_dn));
  for (int i = 0; i < 3; ++i) extractor.extract(frame_, stripe_);
  const testing::AllocationCounter allocations;
  extractor.extract(frame_, stripe_);
  EXPECT_EQ(allocations.count(), 0U);
  EXPECT_GT(count_doubted(extractor), 0);
}

TEST_F(ReturnConfidenceOnABoard, AllocatesNothingPerFrame) {
  for (int i = 0; i < 3; ++i) extractor_.extract(frame_, stripe_);
  const testing::AllocationCounter allocations;
  extractor_.extract(frame_, stripe_);
  EXPECT_EQ(allocations.count(), 0U);
}

}  // namespace
}  // namespace striper::detail
