// SPDX-License-Identifier: Apache-2.0
// Proves that boosting finds how probable each example is, whatever the depth, whose errors are
// larger and whose tails are longer, on examples that were drawn anew, and leaves normal errors as
// they are; and that it asks for no evidence but that it may. Does not prove that what was learnt
// of images is true.
#include "boosted_trees.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <gtest/gtest.h>

#include "support/random.hpp"

namespace striper::bench {
namespace {

using detail::Evidence;

constexpr std::size_t kExamples = 60000;
constexpr std::size_t kGroup = 1;  // The kind that tells two groups; the one before it tells none.

bool is_second(const Evidence& evidence) { return evidence.of[kGroup] > 0.5F; }

// @param error of an example of the first or the second group, in sigmas.
template <typename Draw>
Examples examples_of(const Draw& error) {
  Examples examples;
  examples.kinds = 2;
  for (std::size_t i = 0; i < kExamples; ++i) {
    Evidence evidence;
    evidence.of[0] = static_cast<float>(testing::uniform(-1.0, 1.0));
    evidence.of[kGroup] = static_cast<float>(testing::uniform(0.0, 1.0));
    const double e = error(is_second(evidence));
    examples.evidence.push_back(evidence);
    examples.is_stripe.push_back(1);
    examples.weight.push_back(1.0F);
    examples.squares.push_back(static_cast<float>(e * e));
  }
  return examples;
}

double of_two_sizes(bool is_second) { return testing::normal(0.0, is_second ? 2.0 : 1.0); }

// One error in thirty is five times as large.
double with_a_tail(bool is_second) {
  const bool is_wild = is_second && testing::uniform(0.0, 30.0) < 1.0;
  return testing::normal(0.0, is_wild ? 5.0 : 1.0);
}

// One of ten of the first group is a stripe, seven of the second.
Examples of_two_odds() {
  Examples examples = examples_of(of_two_sizes);
  examples.squares.clear();
  for (std::size_t i = 0; i < kExamples; ++i) {
    const double probability = is_second(examples.evidence[i]) ? 0.7 : 0.1;
    examples.is_stripe[i] = testing::uniform(0.0, 1.0) < probability ? 1 : 0;
  }
  return examples;
}

void expect_two_odds(const BoostOptions& options) {
  const BoostedTrees trees = boost(of_two_odds(), options);
  for (const Evidence& evidence : of_two_odds().evidence) {
    constexpr float kOfABin = 0.03F;  // Limits are quantiles.
    if (std::abs(evidence.of[kGroup] - 0.5F) < kOfABin) continue;
    const double odds = static_cast<double>(detail::weigh(trees.forest(), evidence));
    const double probability = 1.0 / (1.0 + std::exp(-odds));
    ASSERT_NEAR(probability, is_second(evidence) ? 0.7 : 0.1, 0.1) << evidence.of[kGroup];
  }
}

TEST(BoostedTrees, FindHowProbableEachExampleIs) {
  testing::reseed();
  expect_two_odds({.trees = 60, .depth = 1, .rate = 0.2});
  expect_two_odds({.trees = 40, .depth = 5, .rate = 0.2});
  expect_two_odds({.trees = 40, .depth = 8, .rate = 0.2, .prior = 60.0, .one_in = 8});
}

TEST(BoostedTrees, AskForNothingBeforeTheFirstKindThatTheyMay) {
  testing::reseed();
  Examples examples = of_two_odds();
  for (Evidence& evidence : examples.evidence) evidence.of[0] = evidence.of[kGroup];
  examples.first_kind = kGroup;
  const BoostedTrees trees = boost(examples, {.trees = 20, .depth = 3});
  ASSERT_EQ(trees.questions.size(), 60U);
  for (const detail::ChoiceQuestion& question : trees.questions) EXPECT_EQ(question.kind, kGroup);
}

TEST(BoostedTrees, FindWhoseErrorsAreLarger) {
  testing::reseed();
  const BoostedTrees trees = boost(examples_of(of_two_sizes), {.trees = 60, .rate = 0.2});
  double count[2] = {};
  double sigmas[2] = {};
  for (const Evidence& evidence : examples_of(of_two_sizes).evidence) {
    const int group = is_second(evidence) ? 1 : 0;
    count[group] += 1.0;
    sigmas[group] += std::exp(0.5 * static_cast<double>(detail::weigh(trees.forest(), evidence)));
  }
  EXPECT_NEAR(sigmas[0] / count[0], 1.0, 0.02);
  EXPECT_NEAR(sigmas[1] / count[1], 2.0, 0.04);
}

TEST(BoostedTrees, WidenWhatHasATailAndNothingElse) {
  testing::reseed();
  const BoostOptions options{.trees = 60, .rate = 0.3, .prior = 10.0};
  const BoostedTrees tails = boost_tails(examples_of(with_a_tail), options, BoostedTrees{});
  const Examples fresh = examples_of(with_a_tail);
  double count[2] = {};
  double beyond[2] = {};
  double beyond_before[2] = {};
  double widened[2] = {};
  for (std::size_t i = 0; i < kExamples; ++i) {
    const int group = is_second(fresh.evidence[i]) ? 1 : 0;
    const float more = std::max(0.0F, detail::weigh(tails.forest(), fresh.evidence[i]));
    count[group] += 1.0;
    widened[group] += static_cast<double>(std::exp(0.5F * more));
    beyond[group] += fresh.squares[i] > 9.0F * std::exp(more) ? 1.0 : 0.0;
    beyond_before[group] += fresh.squares[i] > 9.0F ? 1.0 : 0.0;
  }
  ASSERT_GT(beyond_before[1] / count[1], 0.015);
  EXPECT_LT(widened[0] / count[0], 1.1);
  EXPECT_NEAR(beyond[0] / count[0], 0.0027, 0.0012);
  EXPECT_NEAR(beyond[1] / count[1], 0.0027, 0.0015);
}

}  // namespace
}  // namespace striper::bench
