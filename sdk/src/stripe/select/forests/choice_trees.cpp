// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "stripe/select/forests/choice_trees.hpp"

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
using BatchInts = hn::Vec<BatchIntTag>;

// Which leaf of the tree each candidate falls into.
HWY_INLINE BatchInts leaf_of(const ChoiceTree& tree, const EvidenceBatch& batch, std::size_t at) {
  const BatchTag d;
  const BatchIntTag di;
  BatchInts leaf = hn::Zero(di);
  for (std::size_t level = 0; level < ChoiceTree::kDepth; ++level) {
    const auto evidence = hn::LoadU(d, batch.of(tree.kind[level]) + at);
    const auto is_more = hn::Gt(evidence, hn::Set(d, tree.limit[level]));
    const auto bit = hn::Set(di, std::int32_t{1} << level);
    leaf = hn::Or(leaf, hn::IfThenElseZero(hn::RebindMask(di, is_more), bit));
  }
  return leaf;
}

void weigh_batch(const ChoiceForest& forest, const EvidenceBatch& batch, BatchOdds& odds) {
  const BatchTag d;
  const BatchIntTag di;
  for (std::size_t at = 0; at < batch.count(); at += hn::Lanes(d)) {
    BatchInts sum = hn::Zero(di);
    for (const ChoiceTree& tree : forest.trees) {
      sum = hn::Add(sum, hn::GatherIndex(di, tree.leaf.data(), leaf_of(tree, batch, at)));
    }
    const auto scaled = hn::Mul(hn::ConvertTo(d, sum), hn::Set(d, ChoiceTree::kUnit));
    hn::StoreU(hn::Add(scaled, hn::Set(d, forest.bias)), d, odds.data() + at);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {
namespace {

// Written by tests/bench/train_choice.sh, which says from what.
#include "stripe/select/forests/first_forest.inc"
#include "stripe/select/forests/fourth_forest.inc"
#include "stripe/select/forests/scatter_forest.inc"
#include "stripe/select/forests/second_forest.inc"
#include "stripe/select/forests/tail_forest.inc"
#include "stripe/select/forests/third_forest.inc"

}  // namespace

HWY_EXPORT(weigh_batch);

ChoiceForest first_forest() noexcept { return {kFirstBias, kFirstTrees}; }
ChoiceForest second_forest() noexcept { return {kSecondBias, kSecondTrees}; }
ChoiceForest third_forest() noexcept { return {kThirdBias, kThirdTrees}; }
ChoiceForest fourth_forest() noexcept { return {kFourthBias, kFourthTrees}; }
ChoiceForest scatter_forest() noexcept { return {kScatterBias, kScatterTrees}; }
ChoiceForest tail_forest() noexcept { return {kTailBias, kTailTrees}; }

float weigh(const ChoiceForest& forest, const Evidence& evidence) noexcept {
  std::int32_t sum = 0;
  for (const ChoiceTree& tree : forest.trees) {
    std::size_t at = 0;
    for (std::size_t level = 0; level < ChoiceTree::kDepth; ++level) {
      at |= static_cast<std::size_t>(evidence.of[tree.kind[level]] > tree.limit[level]) << level;
    }
    sum += tree.leaf[at];
  }
  return forest.bias + ChoiceTree::kUnit * static_cast<float>(sum);
}

void weigh(const ChoiceForest& forest, const EvidenceBatch& batch, BatchOdds& odds) noexcept {
  HWY_DYNAMIC_DISPATCH(weigh_batch)(forest, batch, odds);
}

}  // namespace striper::detail
#endif  // HWY_ONCE
