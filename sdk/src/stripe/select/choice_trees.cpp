// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/choice_trees.hpp"

namespace striper::detail {
namespace {

// Written by tests/bench/choice_training.cpp, which says from what.
#include "stripe/select/first_forest.inc"
#include "stripe/select/second_forest.inc"

}  // namespace

ChoiceForest first_forest() noexcept { return {kFirstBias, kFirstTrees}; }
ChoiceForest second_forest() noexcept { return {kSecondBias, kSecondTrees}; }

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

}  // namespace striper::detail
