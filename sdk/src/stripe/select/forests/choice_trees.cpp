// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "stripe/select/forests/choice_trees.hpp"

#include <utility>

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/select/forests/choice_trees.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
#include "stripe/profile/lanes-inl.hpp"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

using BatchTag = hn::CappedTag<float, EvidenceBatch::kMost>;
using BatchIntTag = hn::RebindToSigned<BatchTag>;

// Of a depth that the compiler knows: unrolled, in half the time.
template <std::size_t kDepth>
void weigh_trees(const ChoiceForest& forest, const EvidenceBatch& batch, BatchOdds& odds) {
  const BatchTag d;
  const BatchIntTag di;
  for (std::size_t at = 0; at < batch.count(); at += hn::Lanes(d)) {
    auto sum = hn::Zero(di);
    const ChoiceQuestion* question = forest.questions.data();
    const std::int32_t* leaves = forest.leaves.data();
    for (std::size_t tree = 0; tree < forest.trees(); ++tree) {
      auto leaf = hn::Zero(di);
      for (std::size_t n = 0; n < kDepth; ++n, ++question) {
        const auto evidence = hn::LoadU(d, batch.of(question->kind) + at);
        const auto is_more = hn::Gt(evidence, hn::Set(d, question->limit));
        const auto bit = hn::Set(di, std::int32_t{1} << n);
        leaf = hn::Or(leaf, hn::IfThenElseZero(hn::RebindMask(di, is_more), bit));
      }
      sum = hn::Add(sum, hn::GatherIndex(di, leaves, leaf));
      leaves += std::size_t{1} << kDepth;
    }
    const auto scaled = hn::Mul(hn::ConvertTo(d, sum), hn::Set(d, ChoiceForest::kUnit));
    hn::StoreU(hn::Add(scaled, hn::Set(d, forest.bias)), d, odds.data() + at);
  }
}

template <std::size_t... kLess>
void weigh_of_depth(std::index_sequence<kLess...> /*less than the depth*/,
                    const ChoiceForest& forest, const EvidenceBatch& batch, BatchOdds& odds) {
  ((forest.depth == kLess + 1 ? weigh_trees<kLess + 1>(forest, batch, odds) : void()), ...);
}

void weigh_batch(const ChoiceForest& forest, const EvidenceBatch& batch, BatchOdds& odds) {
  weigh_of_depth(std::make_index_sequence<ChoiceForest::kMostDepth>{}, forest, batch, odds);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {
namespace {

// Written by tests/bench/train_choice.sh, which says from what.
#include "stripe/select/forests/clipped_forest.inc"
#include "stripe/select/forests/clipped_tail_forest.inc"
#include "stripe/select/forests/fifth_forest.inc"
#include "stripe/select/forests/first_forest.inc"
#include "stripe/select/forests/fourth_forest.inc"
#include "stripe/select/forests/scatter_forest.inc"
#include "stripe/select/forests/second_forest.inc"
#include "stripe/select/forests/tail_forest.inc"
#include "stripe/select/forests/third_forest.inc"

constexpr bool is_depth(std::size_t depth) {
  return depth > 0 && depth <= ChoiceForest::kMostDepth;
}
static_assert(is_depth(kFirstDepth) && is_depth(kSecondDepth) && is_depth(kThirdDepth));
static_assert(is_depth(kFourthDepth) && is_depth(kFifthDepth));
static_assert(is_depth(kScatterDepth) && is_depth(kTailDepth));
static_assert(is_depth(kClippedDepth) && is_depth(kClippedTailDepth));

}  // namespace

HWY_EXPORT(weigh_batch);

ChoiceForest first_forest() noexcept {
  return {kFirstBias, kFirstDepth, kFirstQuestions, kFirstLeaves};
}
ChoiceForest second_forest() noexcept {
  return {kSecondBias, kSecondDepth, kSecondQuestions, kSecondLeaves};
}
ChoiceForest third_forest() noexcept {
  return {kThirdBias, kThirdDepth, kThirdQuestions, kThirdLeaves};
}
ChoiceForest fourth_forest() noexcept {
  return {kFourthBias, kFourthDepth, kFourthQuestions, kFourthLeaves};
}
ChoiceForest fifth_forest() noexcept {
  return {kFifthBias, kFifthDepth, kFifthQuestions, kFifthLeaves};
}
ChoiceForest scatter_forest() noexcept {
  return {kScatterBias, kScatterDepth, kScatterQuestions, kScatterLeaves};
}
ChoiceForest tail_forest() noexcept { return {kTailBias, kTailDepth, kTailQuestions, kTailLeaves}; }
ChoiceForest clipped_forest() noexcept {
  return {kClippedBias, kClippedDepth, kClippedQuestions, kClippedLeaves};
}
ChoiceForest clipped_tail_forest() noexcept {
  return {kClippedTailBias, kClippedTailDepth, kClippedTailQuestions, kClippedTailLeaves};
}

float sigma_factor(float log_variance, float log_tail) noexcept {
  return std::exp(0.5F * (log_variance + std::max(0.0F, log_tail)));
}

float weigh(const ChoiceForest& forest, const Evidence& evidence) noexcept {
  std::int32_t sum = 0;
  for (std::size_t tree = 0; tree < forest.trees(); ++tree) {
    std::size_t leaf = tree << forest.depth;
    for (std::size_t n = 0; n < forest.depth; ++n) {
      const ChoiceQuestion& question = forest.questions[tree * forest.depth + n];
      leaf |= static_cast<std::size_t>(evidence.of[question.kind] > question.limit) << n;
    }
    sum += forest.leaves[leaf];
  }
  return forest.bias + ChoiceForest::kUnit * static_cast<float>(sum);
}

void weigh(const ChoiceForest& forest, const EvidenceBatch& batch, BatchOdds& odds) noexcept {
  HWY_DYNAMIC_DISPATCH(weigh_batch)(forest, batch, odds);
}

}  // namespace striper::detail
#endif  // HWY_ONCE
