// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/stripe_choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace striper::detail {
namespace {

// An orderly frame: so many of its scan lines have a candidate, or so few candidates per scan line
// stand out so far.
constexpr double kNearlyAll = 0.9;
// And hardly anything else (kClutter), or the background under it hardly changes: log, .05 on even
// ones, .13 and more on wood and paper with print.
constexpr float kBareClutter = 0.1F;
constexpr float kEvenLevel = 0.06F;
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
constexpr float kLargestOff = 3.0F;
constexpr float kLargestBend = 1.5F;

// Beyond these log odds no frame of those that were learnt from can tell.
constexpr float kMostLogOdds = 9.0F;
// What is as improbable has no error that is worth a look.
constexpr float kHopelessChosen = -2.0F;
constexpr float kLeastWidth = 0.05F;
constexpr float kLeastSpread = 0.5F;  // Of the background's log heights.

}  // namespace

void StripeChoice::reserve() {
  traits_.reserve(pieces_.most());
  for (std::vector<float>* some :
       {&log_odds_, &scatter_px_, &backward_, &heights_, &heights_near_, &log_variance_}) {
    some->reserve(pieces_.most());
  }
  mean_about_.reserve(pieces_.most());
  background_.reserve(pieces_.most());
  first_.reserve(pieces_);
  second_.reserve(pieces_);
  batched_.reserve(EvidenceBatch::kMost);
  next_.reserve(pieces_.most());
  piece_odds_.reserve(pieces_.most());
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
  measure_scatter();
  weigh_first();
  weigh_again();
  weigh_last();
  choose_in_lines();
  widen_chosen();
}

// Of a candidate and those about it, the mean square running along the piece both ways; what lies
// off the line through two others varies half as much again as a position itself. Noise is known:
// of a single candidate what is more than three sigmas of it counts, of a mean what is more than
// it.
void StripeChoice::measure_scatter() {
  constexpr float kGain = 0.2F;
  constexpr float kPerPosition = 1.0F / 1.5F;
  const std::size_t size = pieces_.size();
  constexpr float kBeyondNoise = 9.0F;
  const auto noise = [&](std::size_t i) {
    return pieces_.candidate(i).sigma * pieces_.candidate(i).sigma;
  };
  const auto off = [&](std::size_t i) {
    const OffLine& line = pieces_.off_line(i);
    const float most = std::max(line.near, line.far);
    return kPerPosition * most * most;
  };
  scatter_px_.resize(size);
  backward_.assign(size, 0.0F);
  for (std::size_t i = size; i-- > 0;) {
    backward_[i] += (backward_[i] > 0.0F ? kGain : 1.0F) * (off(i) - backward_[i]);
    const std::int32_t before = pieces_.link(i).before;
    if (before >= 0) backward_[static_cast<std::size_t>(before)] = backward_[i];
  }
  for (std::size_t i = 0; i < size; ++i) {
    const std::int32_t before = pieces_.link(i).before;
    const float running = before < 0 ? off(i) : scatter_px_[static_cast<std::size_t>(before)];
    scatter_px_[i] = running + kGain * (off(i) - running);
  }
  for (std::size_t i = 0; i < size; ++i) {
    const float own = off(i) > kBeyondNoise * noise(i) ? off(i) : 0.0F;
    const float about = std::max(own, std::max(scatter_px_[i], backward_[i]));
    backward_[i] = std::sqrt(std::max(0.0F, about - noise(i)));
  }
  scatter_px_.swap(backward_);
}

// Whether nearly every scan line shows something, or hardly any shows more than noise may.
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
  if (traits_.coverage() >= kAloneCoverage && traits_.clutter() <= kAloneClutter) return true;
  const bool is_bare =
      traits_.clutter() <= kBareClutter || traits_.main_level_spread() <= kEvenLevel;
  return is_weak || (is_bare && static_cast<double>(lines) >= kNearlyAll * all);
}

// The highest peak of a scan line.
void StripeChoice::choose_highest() {
  log_odds_.assign(pieces_.size(), kPlainLogOdds);
  scatter_px_.assign(pieces_.size(), 0.0F);
  chosen_.assign(static_cast<std::size_t>(pieces_.lines()), Chosen{});
  for (int line = 0; line < pieces_.lines(); ++line) {
    Chosen& chosen = chosen_[static_cast<std::size_t>(line)];
    float highest = 0.0F;
    for (std::size_t i = pieces_.first_of(line); i < pieces_.first_of(line + 1); ++i) {
      if (!(pieces_.candidate(i).amplitude > highest)) continue;
      highest = pieces_.candidate(i).amplitude;
      chosen.candidate = static_cast<std::int32_t>(i);
      chosen.confidence = 1.0F;
    }
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

void StripeChoice::add_piece(std::size_t piece, Evidence& e) const noexcept {
  const PieceTraits::Trait& t = traits_.of_piece(piece);
  const Piece& p = pieces_.pieces()[piece];
  e.of[Evidence::kLength] = fast_log2(static_cast<float>(p.count));
  e.of[Evidence::kSupport] = fast_log2(static_cast<float>(p.support));
  e.of[Evidence::kRoughness] = t.roughness;
  e.of[Evidence::kBends] = t.bends;
  const bool has_width = t.width > kLeastWidth;
  e.of[Evidence::kWidth] = has_width ? fast_log2(t.width / traits_.width_scale()) : 0.0F;
  e.of[Evidence::kWidthSpread] = t.width_spread;
  e.of[Evidence::kHeight] = t.height - traits_.main_height();
  e.of[Evidence::kHeightChange] = t.height_change;
  e.of[Evidence::kTilt] = t.tilt;
  e.of[Evidence::kSnr] = t.snr;
  e.of[Evidence::kClipped] = t.clipped;
  e.of[Evidence::kHeightSpread] = t.height_spread;
  e.of[Evidence::kLightSpread] = t.light_spread;
  e.of[Evidence::kLightFollows] = t.follows;
  e.of[Evidence::kLight] = t.light;
  e.of[Evidence::kLightOff] = t.light - traits_.main_light();
  const bool has_gain = t.gain > 0.5F * Evidence::kUnknown;
  e.of[Evidence::kGain] = has_gain ? t.gain - traits_.main_gain() : Evidence::kUnknown;
  e.of[Evidence::kMisfit] = t.misfit;
  e.of[Evidence::kTexture] = t.texture;
  e.of[Evidence::kCoverage] = traits_.coverage();
  e.of[Evidence::kClutter] = traits_.clutter();
  e.of[Evidence::kHidden] = context_.is_hidden ? 1.0F : 0.0F;
  e.of[Evidence::kWidthKnown] = context_.is_width_known ? 1.0F : 0.0F;
}

// Of the background, from a candidate to those beside it in its piece.
float StripeChoice::level_step(std::size_t candidate) const noexcept {
  const auto level = [&](std::size_t i) {
    const PieceTraits::Look& look = traits_.of_candidate(i);
    return look.height - look.light;
  };
  float step = 0.0F;
  for (const std::int32_t beside : {pieces_.link(candidate).before, next_[candidate]}) {
    if (beside < 0) continue;
    step = std::max(step, std::abs(level(static_cast<std::size_t>(beside)) - level(candidate)));
  }
  return step;
}

void StripeChoice::add_own(std::size_t candidate, Evidence& e) const noexcept {
  const Candidate& c = pieces_.candidate(candidate);
  const Link& link = pieces_.link(candidate);
  const auto p = static_cast<std::size_t>(link.piece);
  const Piece& piece = pieces_.pieces()[p];
  const PieceTraits::Trait& t = traits_.of_piece(p);
  const PieceTraits::Look& look = traits_.of_candidate(candidate);
  const auto expected = static_cast<float>(traits_.width().at(static_cast<double>(c.across)));
  const float width = std::max(c.width / expected, kLeastWidth);
  e.of[Evidence::kOwnWidth] = c.is_clipped ? 0.0F : fast_log2(width);
  const bool has_width = !c.is_clipped && t.width > kLeastWidth;
  e.of[Evidence::kOwnWidthOfPiece] =
      has_width ? std::abs(fast_log2(width * traits_.width_scale() / t.width)) : 0.0F;
  e.of[Evidence::kOwnBend] = std::min(std::abs(link.bend), kLargestBend);
  e.of[Evidence::kOwnOffNear] = std::min(pieces_.off_line(candidate).near, kLargestOff);
  e.of[Evidence::kOwnOffFar] = std::min(pieces_.off_line(candidate).far, kLargestOff);
  const std::int32_t end = std::min(c.line - piece.first_line, piece.last_line - c.line);
  e.of[Evidence::kOwnEnd] = static_cast<float>(end);
  e.of[Evidence::kOwnHeight] = look.height - t.height;
  e.of[Evidence::kOwnSnr] = fast_log2(std::max(1.0F, c.snr));
  e.of[Evidence::kOwnTilt] = c.tilt;
  e.of[Evidence::kOwnMisfit] = look.misfit;
  e.of[Evidence::kOwnLight] = look.light;
  e.of[Evidence::kOwnLightOff] = look.light - t.light;
  const bool has_gain = look.gain > 0.5F * Evidence::kUnknown;
  e.of[Evidence::kOwnGain] = has_gain ? look.gain - traits_.main_gain() : Evidence::kUnknown;
  e.of[Evidence::kOwnSigma] = fast_log2(std::max(scatter_px_[candidate], c.sigma) / expected);
  e.of[Evidence::kOwnLevelStep] = level_step(candidate);
  e.of[Evidence::kOwnSides] = look.sides;
  e.of[Evidence::kOwnTexture] = look.texture;
  add_rivals(candidate, e);
  const float near = heights_near_[candidate];
  e.of[Evidence::kOwnHeightNear] = near > Evidence::kUnknown ? look.height - near : 0.0F;
}

void StripeChoice::add_rivals(std::size_t candidate, Evidence& e) const noexcept {
  constexpr float kMostAway = 6.0F;  // Log of widths: none.
  const Candidate& c = pieces_.candidate(candidate);
  const std::size_t first = pieces_.first_of(c.line);
  const std::size_t last = pieces_.first_of(c.line + 1);
  std::size_t higher = 0;
  float highest = 0.0F;
  float nearest = std::numeric_limits<float>::max();
  for (std::size_t i = first; i < last; ++i) {
    if (i == candidate) continue;
    const Candidate& other = pieces_.candidate(i);
    higher += static_cast<std::size_t>(other.amplitude > c.amplitude);
    highest = std::max(highest, other.amplitude);
    nearest = std::min(nearest, std::abs(other.across - c.across));
  }
  const auto expected = static_cast<float>(traits_.width().at(static_cast<double>(c.across)));
  e.of[Evidence::kOwnRank] = static_cast<float>(higher);
  e.of[Evidence::kOwnRivals] = static_cast<float>(last - first);
  const bool has_rival = last - first > 1;
  e.of[Evidence::kOwnRivalHeight] =
      has_rival ? fast_log2(c.amplitude / highest) : -Evidence::kUnknown;
  e.of[Evidence::kOwnRivalAway] =
      has_rival ? std::min(kMostAway, fast_log2(std::max(nearest, kLeastWidth) / expected))
                : kMostAway;
}

void StripeChoice::add_first(std::size_t candidate, Evidence& e) const noexcept {
  const Candidate& c = pieces_.candidate(candidate);
  const PieceTraits::Look& look = traits_.of_candidate(candidate);
  const auto piece = static_cast<std::size_t>(pieces_.link(candidate).piece);
  const PieceOdds& odds = piece_odds_[piece];
  e.of[Evidence::kFirst] = first_.odds(candidate);
  e.of[Evidence::kFirstOfPiece] = first_.of_piece(piece);
  e.of[Evidence::kFirstRival] = first_.rival(candidate);
  e.of[Evidence::kFirstPieceRival] = first_.rival_of_piece(piece);
  e.of[Evidence::kFirstCoverage] = stripe_.coverage;
  e.of[Evidence::kFirstBefore] = odds.before;
  e.of[Evidence::kFirstAfter] = odds.after;
  const auto expected = static_cast<float>(traits_.width().at(static_cast<double>(c.across)));
  const float width = fast_log2(std::max(c.width / expected, kLeastWidth));
  e.of[Evidence::kFirstWidth] = c.is_clipped ? 0.0F : width - stripe_.width;
  e.of[Evidence::kFirstHeight] = look.height - stripe_.height;
  e.of[Evidence::kFirstLight] = look.light - stripe_.light;
  const bool has_gain = look.gain > 0.5F * Evidence::kUnknown;
  e.of[Evidence::kFirstGain] = has_gain ? look.gain - stripe_.gain : Evidence::kUnknown;
  e.of[Evidence::kFirstNear] = first_.near(candidate);
  e.of[Evidence::kFirstNearRival] = first_.near_rival(candidate);
  e.of[Evidence::kFirstOfJoined] = odds.of_joined;
  e.of[Evidence::kFirstJoined] = fast_log2(1.0F + odds.joined);
  e.of[Evidence::kFirstRunnerUp] = stripe_.runner_up;
  const float above = look.height - background_.height();
  e.of[Evidence::kFirstBackHeight] = above;
  e.of[Evidence::kFirstBackScore] = above / std::max(kLeastSpread, background_.spread());
  e.of[Evidence::kFirstBackAsLong] = background_.as_long_as(pieces_, piece);
  const LineSupport::Support& lines = first_.lines(candidate);
  const LineSupport::Support rival = first_.lines_of_rivals(pieces_, candidate);
  e.of[Evidence::kLineFar] = lines.far;
  e.of[Evidence::kLineNear] = lines.near;
  e.of[Evidence::kLineHits] = lines.hits;
  e.of[Evidence::kLineStand] = lines.stand;
  e.of[Evidence::kLineFarRival] = rival.far;
  e.of[Evidence::kLineNearRival] = rival.near;
}

Evidence StripeChoice::evidence(std::size_t candidate) const noexcept {
  Evidence e = weighed_once(candidate);
  add_second(candidate, e);
  return e;
}

Evidence StripeChoice::weighed_once(std::size_t candidate) const noexcept {
  Evidence e;
  add_piece(static_cast<std::size_t>(pieces_.link(candidate).piece), e);
  add_own(candidate, e);
  add_first(candidate, e);
  return e;
}

void StripeChoice::add_second(std::size_t candidate, Evidence& e) const noexcept {
  const auto piece = static_cast<std::size_t>(pieces_.link(candidate).piece);
  const LineSupport::Support& lines = second_.lines(candidate);
  const LineSupport::Support rival = second_.lines_of_rivals(pieces_, candidate);
  e.of[Evidence::kSecond] = second_.odds(candidate);
  e.of[Evidence::kSecondOfPiece] = second_.of_piece(piece);
  e.of[Evidence::kSecondRival] = second_.rival(candidate);
  e.of[Evidence::kSecondNear] = second_.near(candidate);
  e.of[Evidence::kSecondNearRival] = second_.near_rival(candidate);
  e.of[Evidence::kSecondCoverage] = second_.coverage();
  e.of[Evidence::kSecondLineFar] = lines.far;
  e.of[Evidence::kSecondLineNear] = lines.near;
  e.of[Evidence::kSecondLineFarRival] = rival.far;
  e.of[Evidence::kSecondLineNearRival] = rival.near;
}

void StripeChoice::find_heights_near() {
  heights_.resize(pieces_.size());
  for (std::size_t i = 0; i < pieces_.size(); ++i) heights_[i] = traits_.of_candidate(i).height;
  mean_about_.find(pieces_, heights_, Evidence::kUnknown, heights_near_);
}

void StripeChoice::weigh_first() {
  find_heights_near();
  next_.assign(pieces_.size(), -1);
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const std::int32_t before = pieces_.link(i).before;
    if (before >= 0) next_[static_cast<std::size_t>(before)] = static_cast<std::int32_t>(i);
  }
  log_odds_.resize(pieces_.size());
  batched_.clear();
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    Evidence e;
    add_piece(static_cast<std::size_t>(pieces_.link(i).piece), e);
    add_own(i, e);
    add_to_batch(first_forest(), i, e, log_odds_);
  }
  finish_batch(first_forest(), log_odds_);
  first_.sum_up(pieces_, log_odds_);
  sum_up_joined();
  find_stripe_mean();
  find_runner_up();
  background_.sum_up(pieces_, heights_, log_odds_);
}

// Along the pieces that a straight line joins: forward, then back, so that each knows of all.
void StripeChoice::sum_up_joined() {
  piece_odds_.assign(pieces_.pieces().size(), PieceOdds{});
  for (std::size_t p = 0; p < piece_odds_.size(); ++p) {
    const Piece& piece = pieces_.pieces()[p];
    piece_odds_[p].before = first_.best_of_line(pieces_, piece.first_line - 1);
    piece_odds_[p].after = first_.best_of_line(pieces_, piece.last_line + 1);
  }
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    PieceOdds& odds = piece_odds_[static_cast<std::size_t>(pieces_.link(i).piece)];
    odds.joined += logistic(first_.odds(i));
  }
  const auto join = [&](std::size_t from, std::size_t to) {
    piece_odds_[to].of_joined = std::max(piece_odds_[to].of_joined, first_.of_piece(from));
  };
  const std::size_t size = piece_odds_.size();
  for (std::size_t p = 0; p < size; ++p) {
    if (pieces_.pieces()[p].before < 0) continue;
    const auto before = static_cast<std::size_t>(pieces_.pieces()[p].before);
    join(before, p);
    join(p, before);
    piece_odds_[p].joined += piece_odds_[before].joined;
  }
  for (std::size_t p = size; p-- > 0;) {
    if (pieces_.pieces()[p].before < 0) continue;
    float& before = piece_odds_[static_cast<std::size_t>(pieces_.pieces()[p].before)].joined;
    before = std::max(before, piece_odds_[p].joined);
  }
}

void StripeChoice::find_runner_up() {
  float sum = 0.0F;
  for (int line = 0; line < pieces_.lines(); ++line) {
    float best = Evidence::kUnknown;
    float second = Evidence::kUnknown;
    for (std::size_t i = pieces_.first_of(line); i < pieces_.first_of(line + 1); ++i) {
      second = std::max(second, std::min(best, first_.odds(i)));
      best = std::max(best, first_.odds(i));
    }
    sum += logistic(second);
  }
  stripe_.runner_up = sum / static_cast<float>(std::max(1, pieces_.lines()));
}

void StripeChoice::find_stripe_mean() {
  stripe_ = StripeMean{};
  float sum = 0.0F;
  float widths = 0.0F;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    if (first_.odds(i) < 0.0F || first_.odds(i) < first_.rival(i)) continue;
    const Candidate& c = pieces_.candidate(i);
    const PieceTraits::Look& look = traits_.of_candidate(i);
    const float share = logistic(first_.odds(i));
    sum += share;
    stripe_.height += share * look.height;
    stripe_.light += share * look.light;
    stripe_.gain += share * look.gain;
    if (c.is_clipped) continue;
    const auto expected = static_cast<float>(traits_.width().at(static_cast<double>(c.across)));
    stripe_.width += share * fast_log2(std::max(c.width / expected, kLeastWidth));
    widths += share;
  }
  if (widths > 0.0F) stripe_.width /= widths;
  stripe_.coverage = sum / static_cast<float>(std::max(1, pieces_.lines()));
  if (!(sum > 0.0F)) return;
  for (float* mean : {&stripe_.height, &stripe_.light, &stripe_.gain}) *mean /= sum;
}

void StripeChoice::weigh_again() {
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    if (!first_.is_hopeless(i)) add_to_batch(second_forest(), i, weighed_once(i), log_odds_);
  }
  finish_batch(second_forest(), log_odds_);
  second_.sum_up(pieces_, log_odds_);
}

void StripeChoice::weigh_last() {
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    if (!second_.is_hopeless(i)) add_to_batch(third_forest(), i, evidence(i), log_odds_);
  }
  finish_batch(third_forest(), log_odds_);
  for (float& odds : log_odds_) odds = std::min(kMostLogOdds, odds);
}

void StripeChoice::add_to_batch(const ChoiceForest& forest, std::size_t candidate,
                                const Evidence& evidence, std::vector<float>& odds) {
  batch_.add(evidence);
  batched_.push_back(candidate);
  if (batch_.is_full()) finish_batch(forest, odds);
}

void StripeChoice::finish_batch(const ChoiceForest& forest, std::vector<float>& odds) {
  BatchOdds weighed{};
  detail::weigh(forest, batch_, weighed);
  for (std::size_t n = 0; n < batched_.size(); ++n) odds[batched_[n]] = weighed[n];
  batch_.clear();
  batched_.clear();
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
  log_variance_.assign(pieces_.size(), 0.0F);
  batched_.clear();
  for (const Chosen& chosen : chosen_) {
    if (chosen.candidate < 0) continue;
    const auto i = static_cast<std::size_t>(chosen.candidate);
    if (log_odds_[i] < kHopelessChosen || pieces_.candidate(i).is_clipped) continue;
    add_to_batch(scatter_forest(), i, weighed_once(i), log_variance_);
  }
  finish_batch(scatter_forest(), log_variance_);
  for (Chosen& chosen : chosen_) {
    if (chosen.candidate < 0) continue;
    const float more = log_variance_[static_cast<std::size_t>(chosen.candidate)];
    chosen.sigma_factor = std::exp(0.5F * more);
  }
}

}  // namespace striper::detail
