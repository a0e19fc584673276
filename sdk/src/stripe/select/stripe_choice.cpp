// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/stripe_choice.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

// An orderly frame: so many of its scan lines have a candidate, or so few candidates per scan line
// stand out so far.
constexpr double kNearlyAll = 0.9;
// And hardly anything else (kClutter), or the background under it hardly changes: log, .05 on even
// ones, .13 and more on wood and paper with print.
constexpr float kBareClutter = 0.1F;
constexpr float kEvenLevel = 0.06F;
// And in hardly any scan line the highest candidate is bold and of a piece shorter than this: a
// lamp's, or the edge of a box, beside a stripe on a wall. room.yaml and a wall have no such scan
// lines; of 300 rooms (seeds from 96000) three were plain but for them: 96049 with 1.7 % had 17
// wrong returns, 96167 with 3.8 % 12, 96223 with .8 % one. Of few scan lines, and where no width
// tells what is the stripe, none is looked at so.
constexpr float kBoldSignificance = 16.0F;
constexpr int kShort = 16;
constexpr double kFewShort = 0.015;
constexpr int kFewLines = 8 * kShort;
// A plain frame whose pieces cover less (kCoverage) has no stripe: .001 of a kerb's own edges.
constexpr float kLeastCoverage = 0.005F;
constexpr double kMostlyWeak = 0.7;
constexpr double kFewClear = 0.3;
// Or what is like a stripe covers so much, and there is hardly anything else: as kCoverage,
// kClutter.
constexpr float kAloneCoverage = 0.2F;
constexpr float kAloneClutter = 0.02F;
constexpr float kClearSignificance = 8.0F;
constexpr double kLittle = 0.02;
constexpr float kPlainLogOdds = 12.0F;

}  // namespace

void StripeChoice::reserve() {
  traits_.reserve(pieces_.most());
  log_odds_.reserve(pieces_.most());
  scatter_.reserve(pieces_.most());
  evidence_.reserve(pieces_);
}

void StripeChoice::survey(const PeakCandidates& candidates, const ChoiceContext& context,
                          float threshold) {
  pieces_.find(candidates, context.width, threshold);
  reserve();
  context_ = context;
  traits_.sum_up(pieces_, context);
}

void StripeChoice::choose(const PeakCandidates& candidates, const ChoiceContext& context,
                          float threshold) {
  survey(candidates, context, threshold);
  is_plain_ = context.is_subtracted || context.is_by_itself || (!context.is_hidden && is_orderly());
  const bool has_background = !context.is_subtracted && !context.is_by_itself;
  is_scattered_ = is_plain_ && has_background && traits_.coverage() < kLeastCoverage;
  if (is_plain_) {
    choose_highest();
    return;
  }
  if (!context.is_hidden) return;
  pieces_.measure_off_line();
  traits_.look_closer(pieces_, context);
  scatter_.measure(pieces_);
  weigh_first();
  weigh_again();
  weigh_last();
  choose_in_lines();
  widen_chosen();
}

// Whether nearly every scan line shows something, and it goes on; or hardly any shows more than
// noise may.
bool StripeChoice::is_orderly() const noexcept {
  std::size_t clear = 0;
  std::size_t lines = 0;
  std::size_t weak = 0;
  for (int line = 0; line < pieces_.lines(); ++line) {
    lines += static_cast<std::size_t>(pieces_.first_of(line + 1) > pieces_.first_of(line));
  }
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const Candidate& c = pieces_.candidate(i);
    clear += static_cast<std::size_t>(c.list->significance[c.at] >= kClearSignificance);
    weak += static_cast<std::size_t>(c.list->significance[c.at] < kClearSignificance);
  }
  const auto all = static_cast<double>(pieces_.lines());
  if (static_cast<double>(clear) <= kLittle * all) return true;
  // A weak stripe is among noise, not among other things.
  const bool is_weak =
      static_cast<double>(weak) >= kMostlyWeak * static_cast<double>(weak + clear) &&
      static_cast<double>(clear) < kFewClear * all;
  if (is_weak) return true;
  const bool is_alone = traits_.coverage() >= kAloneCoverage && traits_.clutter() <= kAloneClutter;
  const bool is_bare =
      traits_.clutter() <= kBareClutter || traits_.main_level_spread() <= kEvenLevel;
  const bool is_everywhere = static_cast<double>(lines) >= kNearlyAll * all;
  return (is_alone || (is_bare && is_everywhere)) && !has_short_things();
}

// Whether in more than a few scan lines something bold is the highest that hardly goes on.
bool StripeChoice::has_short_things() const noexcept {
  if (pieces_.lines() < kFewLines || !context_.is_width_known) return false;
  int short_lines = 0;
  for (int line = 0; line < pieces_.lines(); ++line) {
    const std::int32_t highest = highest_of(line);
    if (highest < 0) continue;
    const auto i = static_cast<std::size_t>(highest);
    const Candidate& c = pieces_.candidate(i);
    const bool is_bold = c.list->significance[c.at] >= kBoldSignificance;
    const int length = pieces_.pieces()[static_cast<std::size_t>(pieces_.link(i).piece)].count;
    short_lines += is_bold && length < kShort ? 1 : 0;
  }
  return static_cast<double>(short_lines) > kFewShort * static_cast<double>(pieces_.lines());
}

// A scan line's highest candidate; -1: it has none.
std::int32_t StripeChoice::highest_of(int line) const noexcept {
  std::int32_t highest = -1;
  float amplitude = 0.0F;
  for (std::size_t i = pieces_.first_of(line); i < pieces_.first_of(line + 1); ++i) {
    if (!(pieces_.candidate(i).amplitude > amplitude)) continue;
    amplitude = pieces_.candidate(i).amplitude;
    highest = static_cast<std::int32_t>(i);
  }
  return highest;
}

// The highest peak of a scan line.
void StripeChoice::choose_highest() {
  log_odds_.assign(pieces_.size(), kPlainLogOdds);
  scatter_.clear(pieces_);
  chosen_.assign(static_cast<std::size_t>(pieces_.lines()), Chosen{});
  for (int line = 0; line < pieces_.lines(); ++line) {
    Chosen& chosen = chosen_[static_cast<std::size_t>(line)];
    chosen.candidate = highest_of(line);
    chosen.confidence = chosen.candidate < 0 ? 0.0F : 1.0F;
  }
}

// A stripe is the only thing of its kind in a scan line: others as like it count against it.
float StripeChoice::merit() const noexcept {
  float merit = 0.0F;
  for (int line = 0; line < pieces_.lines(); ++line) {
    float best = 0.0F;
    float sum = 0.0F;
    for (std::size_t i = pieces_.first_of(line); i < pieces_.first_of(line + 1); ++i) {
      const auto p = static_cast<std::size_t>(pieces_.link(i).piece);
      const float likeness = traits_.likeness(p);
      best = std::max(best, likeness);
      sum += likeness;
    }
    merit += 2.0F * best - sum;
  }
  return merit;
}

void StripeChoice::weigh_first() {
  evidence_.begin(looked_at());
  log_odds_.resize(pieces_.size());
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    add_to_batch(first_forest(), i, evidence_.for_first(looked_at(), i), log_odds_);
  }
  finish_batch(first_forest(), log_odds_);
  evidence_.hear_first(looked_at(), log_odds_);
}

void StripeChoice::weigh_again() {
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    if (evidence_.first().is_hopeless(i)) continue;
    add_to_batch(second_forest(), i, evidence_.for_second(looked_at(), i), log_odds_);
  }
  finish_batch(second_forest(), log_odds_);
  evidence_.hear_second(looked_at(), log_odds_);
}

void StripeChoice::weigh_last() {
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    if (!evidence_.second().is_hopeless(i)) add_to_batch(third_forest(), i, evidence(i), log_odds_);
  }
  finish_batch(third_forest(), log_odds_);
  for (float& odds : log_odds_) odds = std::min(kMostLogOdds, odds);
}

void StripeChoice::add_to_batch(const ChoiceForest& forest, std::size_t candidate,
                                const Evidence& evidence, std::vector<float>& odds) {
  batch_.add(evidence, candidate);
  if (batch_.is_full()) finish_batch(forest, odds);
}

void StripeChoice::finish_batch(const ChoiceForest& forest, std::vector<float>& odds) {
  BatchOdds weighed{};
  detail::weigh(forest, batch_, weighed);
  for (std::size_t n = 0; n < batch_.count(); ++n) odds[batch_.owner(n)] = weighed[n];
  batch_.clear();
}

// The candidates of a scan line exclude one another, and each is the stripe or not.
void StripeChoice::choose_in_lines() {
  chosen_.assign(static_cast<std::size_t>(pieces_.lines()), Chosen{});
  for (int line = 0; line < pieces_.lines(); ++line) {
    Chosen& chosen = chosen_[static_cast<std::size_t>(line)];
    float best = -30.0F;
    float next = -30.0F;
    for (std::size_t i = pieces_.first_of(line); i < pieces_.first_of(line + 1); ++i) {
      const float odds = log_odds_[i];
      if (odds > best) {
        next = best;
        chosen.rival_candidate = chosen.candidate;
        best = odds;
        chosen.candidate = static_cast<std::int32_t>(i);
      } else if (odds > next) {
        next = odds;
        chosen.rival_candidate = static_cast<std::int32_t>(i);
      }
    }
    if (chosen.candidate < 0) continue;
    chosen.confidence = logistic(best);
    chosen.rival = std::min(logistic(next), 1.0F - chosen.confidence);
  }
}

// Beside edges, at ends and between textures a position is off by more than noise and its
// neighbours tell; by how much, scenes with truth do.
void StripeChoice::widen_chosen() {
  for (std::size_t line = 0; line < chosen_.size(); ++line) {
    const Chosen& chosen = chosen_[line];
    if (chosen.candidate < 0) continue;
    const auto i = static_cast<std::size_t>(chosen.candidate);
    if (log_odds_[i] < kHopelessChosen || pieces_.candidate(i).is_clipped) continue;
    batch_.add(evidence(i), line);
    if (batch_.is_full()) widen_batch();
  }
  widen_batch();
}

void StripeChoice::widen_batch() {
  BatchOdds log_variance{};
  BatchOdds log_tail{};
  detail::weigh(scatter_forest(), batch_, log_variance);
  detail::weigh(tail_forest(), batch_, log_tail);
  for (std::size_t n = 0; n < batch_.count(); ++n) {
    chosen_[batch_.owner(n)].sigma_factor = sigma_factor(log_variance[n], log_tail[n]);
  }
  batch_.clear();
}

}  // namespace striper::detail
