// SPDX-License-Identifier: Apache-2.0
#include "stripe/report/return_confidence.hpp"

#include <algorithm>

#include "stripe/report/line_odds.hpp"
#include "stripe/report/patches/rated_patches.hpp"
#include "stripe/select/piece_traits.hpp"

namespace striper::detail {
namespace {

// Of a return: more than a scan line has that has none.
constexpr float kLeastLogOdds = 0.999F * kNoReturn;
// One scan line in so many is sure where the image about others is looked at: the network learnt of
// rooms that were rendered, nearly all with a laser. Of boards photographed without one it made up
// to one column in a hundred sure, where nothing was before.
constexpr std::size_t kOneIsSureOf = 20;

}  // namespace

void ReturnConfidence::begin(std::size_t lines) {
  odds_.assign(lines, kNoReturn);
  among_others_.assign(lines, kNoReturn);
  neighbours_.begin(lines);
}

std::optional<float> ReturnConfidence::of_line(std::size_t line) const noexcept {
  if (!(odds_[line] > kNoReturn)) return std::nullopt;
  return logistic(odds_[line]);
}

void ReturnConfidence::rate_alone(const ReturnEvidence& evidence, const Measured& measured,
                                  const Stripe& stripe) {
  weigh_returns(fourth_forest(), evidence.returns(),
                [&](std::size_t line) { return evidence.of(measured, stripe, line); });
}

void ReturnConfidence::rate_among_others(const ReturnEvidence& evidence, const Measured& measured,
                                         const Stripe& stripe) {
  neighbours_.hear(stripe, odds_);
  weigh_returns(fifth_forest(), evidence.returns(), [&](std::size_t line) {
    Evidence e;
    evidence.add_measured(measured, stripe, line, e);
    neighbours_.add_to(e, line);
    return e;
  });
}

void ReturnConfidence::rate_by_image(const ReturnEvidence& evidence, const Measured& measured,
                                     const LitFrame& frame, const Stripe& stripe) {
  among_others_.assign(odds_.begin(), odds_.end());
  const auto sure =
      std::count_if(odds_.begin(), odds_.end(), [](float odds) { return logistic(odds) >= kSure; });
  if (kOneIsSureOf * static_cast<std::size_t>(sure) < odds_.size()) return;
  RatedPatches patches({frame, stripe, among_others_});
  for (const std::size_t line : evidence.returns()) {
    if (!RatedPatches::is_doubted(among_others_[line])) continue;
    Evidence e = evidence.of(measured, stripe, line);
    neighbours_.add_to(e, line);
    patches.look_at(line);
    const float odds = among_others_[line] + patches.more_log_odds(e);
    odds_[line] = std::clamp(odds, kLeastLogOdds, kMostLogOdds);
  }
}

template <typename EvidenceOf>
void ReturnConfidence::weigh_returns(const ChoiceForest& forest,
                                     const std::vector<std::size_t>& returns,
                                     EvidenceOf evidence_of) {
  const auto finish = [&] {
    BatchOdds odds{};
    detail::weigh(forest, batch_, odds);
    for (std::size_t n = 0; n < batch_.count(); ++n)
      odds_[batch_.owner(n)] = std::clamp(odds[n], kLeastLogOdds, kMostLogOdds);
    batch_.clear();
  };
  for (const std::size_t line : returns) {
    batch_.add(evidence_of(line), line);
    if (batch_.is_full()) finish();
  }
  finish();
}

}  // namespace striper::detail
