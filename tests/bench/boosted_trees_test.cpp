// SPDX-License-Identifier: Apache-2.0
// Proves that boosting finds whose errors are larger and whose tails are longer, on errors that
// were drawn anew, and leaves normal errors as they are. Does not prove that what was learnt of
// images is true.
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
