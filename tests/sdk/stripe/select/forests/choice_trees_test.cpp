// SPDX-License-Identifier: Apache-2.0
// Proves: a batch is weighed as its candidates one by one, whatever the instruction set and however
// full it is; the trees that are built in ask only for evidence that was there when they were made.
#include "stripe/select/forests/choice_trees.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "support/instruction_sets.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

using striper::testing::uniform;

Evidence any_evidence() {
  Evidence evidence;
  for (float& value : evidence.of) value = static_cast<float>(uniform(-6.0, 6.0));
  return evidence;
}

void expect_batch_is_as_single(const ChoiceForest& forest) {
  for (std::size_t count = 0; count <= EvidenceBatch::kMost; ++count) {
    EvidenceBatch batch;
    std::vector<float> single;
    for (std::size_t n = 0; n < count; ++n) {
      const Evidence evidence = any_evidence();
      batch.add(evidence, 100 + n);
      single.push_back(weigh(forest, evidence));
    }
    EXPECT_EQ(batch.is_full(), count == EvidenceBatch::kMost);
    BatchOdds odds{};
    weigh(forest, batch, odds);
    for (std::size_t n = 0; n < count; ++n) {
      EXPECT_NEAR(odds[n], single[n], 1e-5) << n;
      EXPECT_EQ(batch.owner(n), 100 + n);
    }
  }
}

struct AnyForest {
  std::vector<ChoiceQuestion> questions;
  std::vector<std::int32_t> leaves;
};

AnyForest any_forest(std::size_t trees, std::size_t depth) {
  AnyForest forest;
  for (std::size_t n = 0; n < trees * depth; ++n) {
    const double kind = uniform(0.0, static_cast<double>(Evidence::kCount) - 0.01);
    forest.questions.push_back(
        {static_cast<std::uint8_t>(kind), static_cast<float>(uniform(-3.0, 3.0))});
  }
  for (std::size_t n = 0; n < trees << depth; ++n)
    forest.leaves.push_back(static_cast<std::int32_t>(uniform(-3000.0, 3000.0)));
  return forest;
}

TEST(ChoiceTrees, WeighABatchAsOneByOneWhateverTheirDepth) {
  testing::reseed();
  testing::for_each_instruction_set([] {
    for (std::size_t depth = 1; depth <= ChoiceForest::kMostDepth; ++depth) {
      SCOPED_TRACE(depth);
      const AnyForest forest = any_forest(7, depth);
      expect_batch_is_as_single({0.25F, depth, forest.questions, forest.leaves});
    }
  });
}

TEST(ChoiceTrees, ABitOfALeafsNumberAnswersAQuestion) {
  const std::vector<ChoiceQuestion> questions{{3, 0.5F}, {7, -1.0F}};
  const std::vector<std::int32_t> leaves{1000, 2000, 4000, 8000};
  const ChoiceForest forest{0.5F, 2, questions, leaves};
  Evidence evidence;
  evidence.of[3] = 0.5F;  // Not above.
  evidence.of[7] = -2.0F;
  EXPECT_NEAR(weigh(forest, evidence), 1.5, 1e-5);
  evidence.of[3] = 0.6F;
  EXPECT_NEAR(weigh(forest, evidence), 2.5, 1e-5);
  evidence.of[7] = 0.0F;
  EXPECT_NEAR(weigh(forest, evidence), 8.5, 1e-5);
  evidence.of[3] = 0.0F;
  EXPECT_NEAR(weigh(forest, evidence), 4.5, 1e-5);
}

TEST(ChoiceTrees, WeighABatchAsOneByOne) {
  testing::for_each_instruction_set([] {
    expect_batch_is_as_single(first_forest());
    expect_batch_is_as_single(second_forest());
    expect_batch_is_as_single(third_forest());
    expect_batch_is_as_single(fourth_forest());
    expect_batch_is_as_single(fifth_forest());
    expect_batch_is_as_single(scatter_forest());
    expect_batch_is_as_single(tail_forest());
    expect_batch_is_as_single(clipped_forest());
    expect_batch_is_as_single(clipped_tail_forest());
  });
}

void expect_asks_between(std::size_t first, std::size_t kinds, const ChoiceForest& forest) {
  ASSERT_GT(forest.trees(), 0U);
  EXPECT_EQ(forest.questions.size(), forest.trees() * forest.depth);
  EXPECT_EQ(forest.leaves.size(), forest.trees() << forest.depth);
  for (const ChoiceQuestion& question : forest.questions) {
    EXPECT_GE(question.kind, first);
    EXPECT_LT(question.kind, kinds);
  }
}

TEST(ChoiceTrees, AskForWhatIsThere) {
  expect_asks_between(0, Evidence::kFirstKinds, first_forest());
  expect_asks_between(0, Evidence::kSecondKinds, second_forest());
  expect_asks_between(0, Evidence::kThirdKinds, third_forest());
  expect_asks_between(0, Evidence::kThirdKinds, scatter_forest());
  expect_asks_between(0, Evidence::kThirdKinds, tail_forest());
  expect_asks_between(0, Evidence::kFourthKinds, fourth_forest());
  expect_asks_between(0, Evidence::kFourthKinds, clipped_forest());
  expect_asks_between(0, Evidence::kFourthKinds, clipped_tail_forest());
  expect_asks_between(Evidence::kThirdKinds, Evidence::kCount, fifth_forest());
}

}  // namespace
}  // namespace striper::detail
