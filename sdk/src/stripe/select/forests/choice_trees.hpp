// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stripe/select/evidence/evidence.hpp"

namespace striper::detail {

/// Whether a kind of the evidence is above a limit.
struct ChoiceQuestion {
  std::uint8_t kind;
  float limit;
};

/// A sum of decision trees: the log odds that what shows such evidence is the stripe.
///
/// Oblivious trees, as Prokhorenkova et al. 2018 boost them: each asks one question of all nodes of
/// a level. No branches, and little to learn by heart.
struct ChoiceForest {
  static constexpr float kUnit = 1e-3F;
  static constexpr std::size_t kMostDepth = 8;

  float bias;
  std::size_t depth;  ///< Questions that a tree asks: 1 to kMostDepth.
  /// Those of each tree after those of the one before it.
  std::span<const ChoiceQuestion> questions;
  /// Each tree's 2^depth log odds over kUnit: bit n of a leaf's number answers question n.
  std::span<const std::int32_t> leaves;

  std::size_t trees() const noexcept { return questions.size() / depth; }
};

/// From what is seen of a candidate, its piece and its frame; once all candidates of a frame have
/// been weighed so, from that too; and once more. Made by tests/bench/train_choice.sh.
ChoiceForest first_forest() noexcept;
ChoiceForest second_forest() noexcept;
ChoiceForest third_forest() noexcept;
/// From that and from how a return was measured: that it is right as it is reported.
ChoiceForest fourth_forest() noexcept;
/// The same once the fourth has rated all returns of a frame: from how it was measured and from
/// what the fourth said of it and of those about it.
ChoiceForest fifth_forest() noexcept;

/// What is as probable is sure: `ok`, unless something else is asked for.
inline constexpr float kSure = 0.99F;
/// Beyond these log odds no frame of those that were learnt from can tell.
inline constexpr float kMostLogOdds = 9.0F;

/// From all of that evidence of what was chosen: natural log of the variance of its position over
/// that which was reckoned.
ChoiceForest scatter_forest() noexcept;
/// And what is added to that, where it is more than 0, since the errors have longer tails than
/// normal ones: so that few are beyond three sigmas.
ChoiceForest tail_forest() noexcept;
/// The same of a clipped return, by how it was measured too.
ChoiceForest clipped_forest() noexcept;
ChoiceForest clipped_tail_forest() noexcept;

/// What a sigma is to be multiplied with, by what such a forest and that of its tails say.
float sigma_factor(float log_variance, float log_tail) noexcept;

/// 2 ns a tree of five questions.
float weigh(const ChoiceForest& forest, const Evidence& evidence) noexcept;

/// The evidence of a few candidates, kind by kind, and whose it is.
class EvidenceBatch {
 public:
  static constexpr std::size_t kMost = 16;

  /// @param owner for whoever asks for it again: a candidate, or a scan line.
  void add(const Evidence& evidence, std::size_t owner) noexcept {
    owners_[count_] = owner;
    for (std::size_t kind = 0; kind < Evidence::kCount; ++kind) {
      of_[kind * kMost + count_] = evidence.of[kind];
    }
    ++count_;
  }
  void clear() noexcept { count_ = 0; }
  bool is_full() const noexcept { return count_ == kMost; }
  std::size_t count() const noexcept { return count_; }
  std::size_t owner(std::size_t n) const noexcept { return owners_[n]; }
  const float* of(std::size_t kind) const noexcept { return of_.data() + kind * kMost; }

 private:
  alignas(64) std::array<float, kMost * Evidence::kCount> of_{};
  std::array<std::size_t, kMost> owners_{};
  std::size_t count_ = 0;
};

using BatchOdds = std::array<float, EvidenceBatch::kMost>;

/// As `weigh`, of all of a batch at once: 10 ns a tree of five questions.
void weigh(const ChoiceForest& forest, const EvidenceBatch& batch, BatchOdds& odds) noexcept;

}  // namespace striper::detail
