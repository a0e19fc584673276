// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/choice_weights.hpp"

#include <algorithm>
#include <array>

namespace striper::detail {
namespace {

using K = Evidence::Kind;

std::array kPieceTerms{
#include "piece_terms.inc"
};

std::array kOwnTerms{
#include "own_terms.inc"
};

}  // namespace

std::span<const ChoiceTerm> piece_terms() noexcept { return kPieceTerms; }
std::span<const ChoiceTerm> own_terms() noexcept { return kOwnTerms; }
std::span<ChoiceTerm> dev_piece_terms() { return kPieceTerms; }
std::span<ChoiceTerm> dev_own_terms() { return kOwnTerms; }

float weigh(std::span<const ChoiceTerm> terms, const Evidence& evidence) noexcept {
  float sum = 0.0F;
  for (const ChoiceTerm& term : terms) {
    sum += term.weight * std::max(0.0F, evidence.of[term.kind] - term.knot);
  }
  return sum;
}

}  // namespace striper::detail
