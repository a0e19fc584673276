// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "stripe/select/forests/choice_trees.hpp"

namespace striper::bench {

/// Examples to learn from, one element each.
struct Examples {
  std::size_t first_kind = 0;  ///< Only evidence from this kind on,
  std::size_t kinds = 0;       ///< and before this one, is asked for.
  std::vector<detail::Evidence> evidence;
  std::vector<std::uint8_t> is_stripe;
  std::vector<float> weight;
  /// Where given, squares of errors in sigmas: not whether it is the stripe is learnt, but the log
  /// of their mean.
  std::vector<float> squares;
};

struct BoostOptions {
  int trees = 100;
  std::size_t depth = 5;  ///< Of each tree, at most ChoiceForest::kMostDepth.
  double rate = 0.25;     ///< Of each tree's Newton step.
  double prior = 20.0;    ///< Added to the Hessian of a leaf: so many examples say nothing.
  unsigned one_in = 2;    ///< A tree's questions are chosen on one example in so many, by chance.
};

/// A forest that owns its trees.
struct BoostedTrees {
  float bias = 0.0F;
  std::size_t depth = 1;
  std::vector<detail::ChoiceQuestion> questions;
  std::vector<std::int32_t> leaves;

  detail::ChoiceForest forest() const { return {bias, depth, questions, leaves}; }
};

/// One tree that says nothing.
BoostedTrees no_trees();

/// Fits a sum of oblivious trees to the log loss, or to the likelihood of normal errors of that
/// variance: Newton boosting (Friedman 2001) over histograms of 64 quantiles, each
/// question chosen from three quarters of the evidence. Minutes; prints the loss.
BoostedTrees boost(const Examples& examples, const BoostOptions& options);

/// Fits by how much more, in log variance, a forest of squares must widen so that 0.27 % of the
/// errors are beyond three sigmas, which a normal distribution has: what scatters as it should on
/// average may have a longer tail, and three sigmas are where gates are set. Below 0 nothing is
/// narrowed.
///
/// Boosts the pinball loss of that quantile. @param held_out examples that `scatter` was not fitted
/// to.
BoostedTrees boost_tails(const Examples& held_out, const BoostOptions& options,
                         const BoostedTrees& scatter);

/// Writes what sdk/src/stripe/select/forests/choice_trees.cpp includes. @param name First, Second,
/// Scatter, Tail, Third, Fourth, Clipped, ClippedTail or Fifth.
void write_trees(const BoostedTrees& trees, const std::string& name, const std::string& path);

}  // namespace striper::bench
