// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/stripe_choice.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "stripe/select/choice_weights.hpp"

namespace striper::detail {
namespace {

// A rougher bend is no rougher: an edge, not a surface. Variances, and pixels.
constexpr float kRoughest = 50.0F;
constexpr float kLargestBend = 1.5F;
// What real surfaces bend by beyond noise, pixels: paint, paper, cloth.
constexpr float kSurfaceBend = 0.1F;
constexpr float kLargestTilt = 1.0F;
constexpr float kLargestChange = 2.0F;
// An orderly frame: so many of its lines have a candidate, or so few candidates a line stand out so
// far.
constexpr double kNearlyAll = 0.9;
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
constexpr float kLargestSnr = 64.0F;
constexpr float kLeastOfWidths = 0.3F;

// To 0.01.
float fast_log2(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  const auto exponent = static_cast<float>(static_cast<int>(bits >> 23U) - 127);
  const auto mantissa = std::bit_cast<float>((bits & 0x7FFFFFU) | 0x3F800000U);
  return exponent + (-0.33582878F * mantissa + 2.0F) * mantissa - 1.65871022F;
}

// The sum of the terms, fitted to candidates of many scenes, as log odds of what is chosen: Platt's
// scaling on rooms of another kind than those (random_room, seeds 1 to 24). Where it says more than
// kMostLogOdds, 3 in 1000 were something else.
constexpr float kCalibrationGain = 2.5F;
constexpr float kCalibrationOffset = 1.6F;
constexpr float kMostLogOdds = 6.0F;

float calibrated(float log_odds) {
  return std::min(kMostLogOdds, kCalibrationGain * log_odds + kCalibrationOffset);
}

// To some thousandths of its value.
float logistic(float x) { return 1.0F / (1.0F + std::exp(-x)); }

}  // namespace

void StripeChoice::choose(const PeakCandidates& candidates, const ChoiceContext& context,
                          float threshold) {
  pieces_.find(candidates, context.width, threshold);
  traits_.reserve(pieces_.most());
  for (std::vector<float>* some : {&log_odds_, &scatter_px_, &backward_}) {
    some->reserve(pieces_.most());
  }
  context_ = context;
  width_ = context.width;
  sum_up(context);
  find_main_pieces(context);
  measure_frame();
  is_plain_ = context.is_subtracted || context.is_by_itself || (!context.is_hidden && is_orderly());
  if (is_plain_) {
    choose_highest();
    return;
  }
  weigh();
  choose_in_lines();
  measure_scatter();
}

// Of a candidate and those about it, the mean square running along the piece both ways; what lies
// off the line through two others varies half as much again as a position itself.
void StripeChoice::measure_scatter() {
  constexpr float kGain = 0.2F;
  constexpr float kPerPosition = 1.0F / 1.5F;
  const std::size_t size = pieces_.size();
  const auto off = [&](std::size_t i) {
    const Link& link = pieces_.link(i);
    const float most = std::max(link.off_near, link.off_far);
    return most * most;
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
    const float about = std::max(off(i), std::max(scatter_px_[i], backward_[i]));
    backward_[i] = std::sqrt(kPerPosition * about);
  }
  scatter_px_.swap(backward_);
}

// Whether nearly every line shows something, or hardly any shows more than noise may.
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
  if (coverage_ >= kAloneCoverage && clutter_ <= kAloneClutter) return true;
  return is_weak || static_cast<double>(lines) >= kNearlyAll * all;
}

// The highest peak of a line.
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

// The traits of each piece.
void StripeChoice::sum_up(const ChoiceContext& context) {
  traits_.assign(pieces_.pieces().size(), Trait{});
  const auto pivot_width = static_cast<float>(context.width.at(0.0));
  const auto slope = static_cast<float>(context.width.slope);
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const Candidate& c = pieces_.candidate(i);
    const Link& link = pieces_.link(i);
    Trait& t = traits_[static_cast<std::size_t>(link.piece)];
    t.height += fast_log2(c.amplitude);
    t.tilt += std::min(c.tilt, kLargestTilt);
    t.snr += std::min(c.snr, kLargestSnr);
    if (c.is_clipped) {
      t.clipped += 1.0F;
    } else {
      t.width += std::min(c.width / (pivot_width + slope * c.across), 4.0F);
      t.seen_widths += 1.0F;
    }
    if (link.before < 0) continue;
    const Candidate& b = pieces_.candidate(static_cast<std::size_t>(link.before));
    t.height_change += std::min(std::abs(c.amplitude - b.amplitude) / b.amplitude, kLargestChange);
    if (!c.is_clipped && !b.is_clipped) {
      t.width_spread += std::min(std::abs(c.width - b.width) / b.width, 1.0F);
    }
    if (!(link.bend_sigma > 0.0F)) continue;
    t.bends += std::min(std::abs(link.bend), kLargestBend);
    const float allowed = link.bend_sigma * link.bend_sigma + kSurfaceBend * kSurfaceBend;
    t.roughness += std::min(link.bend * link.bend / allowed, kRoughest);
  }
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    Trait& t = traits_[p];
    const auto count = static_cast<float>(pieces_.pieces()[p].count);
    const float links = std::max(1.0F, count - 1.0F);
    const float bends = std::max(1.0F, count - 2.0F);
    t.height /= count;
    t.tilt /= count;
    t.snr = fast_log2(std::max(1.0F, t.snr / count));
    t.clipped /= count;
    // What is not clipped of a clipped piece is its ends and what is darker: no sample of it.
    const bool shows_width = t.seen_widths > kLeastOfWidths * count;
    t.width = shows_width ? t.width / t.seen_widths : 0.0F;
    t.height_change /= links;
    t.width_spread /= links;
    t.bends /= bends;
    t.roughness = fast_log2(1.0F + t.roughness / bends);
  }
}

void StripeChoice::guess_pieces(bool use_width) {
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    Trait& t = traits_[p];
    const auto count = static_cast<float>(pieces_.pieces()[p].support);
    const bool has_width = use_width && t.width > 0.0F;
    const float off = has_width ? std::abs(fast_log2(t.width / width_scale_)) : 0.0F;
    t.first_guess = 1.2F * fast_log2(count) - 0.7F * t.roughness - 3.0F * t.bends - 4.0F * t.tilt +
                    0.5F * t.snr - 4.0F * off - 2.0F * t.width_spread - 4.0F;
  }
}

// Which pieces are about as the stripe is, whatever the frame; of the best of them the width, where
// it is not known.
void StripeChoice::find_main_pieces(const ChoiceContext& context) {
  width_scale_ = 1.0F;
  guess_pieces(context.is_width_known);
  if (context.is_width_known) return;
  float best = 0.0F;
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    const Trait& t = traits_[p];
    const auto count = static_cast<float>(pieces_.pieces()[p].count);
    const float merit = count * logistic(t.first_guess);
    if (!(merit > best)) continue;
    best = merit;
    width_scale_ = t.width > 0.0F ? t.width : 1.0F;
  }
  guess_pieces(true);
  width_.at_pivot *= static_cast<double>(width_scale_);
  width_.slope *= static_cast<double>(width_scale_);
}

// What the frame shows as a whole: how high the main pieces are, how much of the lines they cover,
// and how much else there is.
void StripeChoice::measure_frame() {
  float lines = 0.0F;
  float heights = 0.0F;
  float others = 0.0F;
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    const Trait& t = traits_[p];
    const auto count = static_cast<float>(pieces_.pieces()[p].count);
    const float main = count * logistic(t.first_guess);
    lines += main;
    heights += main * t.height;
    others += count - main;
  }
  main_height_ = lines > 0.0F ? heights / lines : 0.0F;
  const auto all = static_cast<float>(std::max(1, pieces_.lines()));
  coverage_ = std::min(1.0F, lines / all);
  clutter_ = fast_log2(1.0F + others / all);
}

// A stripe is the only thing of its kind in a line: others as like it count against it.
float StripeChoice::merit() const noexcept {
  float merit = 0.0F;
  for (int line = 0; line < pieces_.lines(); ++line) {
    float best = 0.0F;
    float sum = 0.0F;
    for (std::size_t i = pieces_.first_of(line); i < pieces_.first_of(line + 1); ++i) {
      const auto p = static_cast<std::size_t>(pieces_.link(i).piece);
      const float likeness = logistic(traits_[p].first_guess);
      best = std::max(best, likeness);
      sum += likeness;
    }
    merit += 2.0F * best - sum;
  }
  return merit;
}

Evidence StripeChoice::evidence_of_piece(std::size_t piece) const noexcept {
  const Trait& t = traits_[piece];
  const auto count = static_cast<float>(pieces_.pieces()[piece].count);
  const float width = t.width > 0.0F ? t.width / width_scale_ : 1.0F;
  Evidence e;
  e.of[Evidence::kOne] = 1.0F;
  e.of[Evidence::kLength] = 0.125F * fast_log2(std::min(count, 256.0F));
  e.of[Evidence::kIsShort] = 1.0F / count;
  const auto support = static_cast<float>(pieces_.pieces()[piece].support);
  e.of[Evidence::kSupport] = 0.125F * fast_log2(std::min(support, 256.0F));
  e.of[Evidence::kRoughness] = 0.2F * t.roughness;
  e.of[Evidence::kBends] = t.bends;
  e.of[Evidence::kWide] = std::clamp(width - 1.0F, 0.0F, 1.0F);
  e.of[Evidence::kNarrow] = std::clamp(1.0F / width - 1.0F, 0.0F, 1.0F);
  e.of[Evidence::kWidthSpread] = t.width_spread;
  e.of[Evidence::kFaint] = 0.25F * std::clamp(main_height_ - t.height, 0.0F, 6.0F);
  e.of[Evidence::kBright] = 0.25F * std::clamp(t.height - main_height_, 0.0F, 6.0F);
  e.of[Evidence::kHeightChange] = t.height_change;
  e.of[Evidence::kTilt] = t.tilt;
  e.of[Evidence::kSnr] = t.snr / 6.0F;
  e.of[Evidence::kClipped] = t.clipped;
  e.of[Evidence::kClippedBright] = e.of[Evidence::kClipped] * e.of[Evidence::kBright];
  e.of[Evidence::kCoverage] = coverage_;
  e.of[Evidence::kClutter] = clutter_;
  e.of[Evidence::kSubtracted] = context_.is_subtracted ? 1.0F : 0.0F;
  e.of[Evidence::kHidden] = context_.is_hidden ? 1.0F : 0.0F;
  e.of[Evidence::kHiddenSupport] = e.of[Evidence::kHidden] * e.of[Evidence::kSupport];
  e.of[Evidence::kClutterSupport] = clutter_ * e.of[Evidence::kSupport];
  const float known = context_.is_width_known ? 1.0F : 0.0F;
  e.of[Evidence::kWideKnown] = known * e.of[Evidence::kWide];
  e.of[Evidence::kNarrowKnown] = known * e.of[Evidence::kNarrow];
  e.of[Evidence::kCoverageShort] = coverage_ / count;
  e.of[Evidence::kClutterShort] = clutter_ / count;
  return e;
}

void StripeChoice::add_own(std::size_t candidate, Evidence& e) const noexcept {
  const Candidate& c = pieces_.candidate(candidate);
  const Link& link = pieces_.link(candidate);
  const auto p = static_cast<std::size_t>(link.piece);
  const Piece& piece = pieces_.pieces()[p];
  if (!c.is_clipped && traits_[p].width > 0.0F) {
    const auto expected = static_cast<float>(width_.at(static_cast<double>(c.across)));
    const float own = c.width * width_scale_ / (expected * traits_[p].width);
    e.of[Evidence::kOwnWidth] = std::min(std::abs(own - 1.0F), 1.0F);
  }
  e.of[Evidence::kOwnBend] = std::min(std::abs(link.bend), kLargestBend);
  e.of[Evidence::kOwnOffNear] = std::min(link.off_near, kLargestOff);
  e.of[Evidence::kOwnOffFar] = std::min(link.off_far, kLargestOff);
  const std::int32_t end = std::min(c.line - piece.first_line, piece.last_line - c.line);
  e.of[Evidence::kOwnEnd] = 1.0F / (1.0F + static_cast<float>(end));
}

Evidence StripeChoice::evidence(std::size_t candidate) const noexcept {
  Evidence e = evidence_of_piece(static_cast<std::size_t>(pieces_.link(candidate).piece));
  add_own(candidate, e);
  return e;
}

void StripeChoice::weigh() {
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    traits_[p].log_odds = detail::weigh(piece_terms(), evidence_of_piece(p));
  }
  log_odds_.resize(pieces_.size());
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    Evidence own;
    add_own(i, own);
    const auto p = static_cast<std::size_t>(pieces_.link(i).piece);
    log_odds_[i] = calibrated(traits_[p].log_odds + detail::weigh(own_terms(), own));
  }
}

// The candidates of a line exclude one another, and each is the stripe or not.
void StripeChoice::choose_in_lines() {
  chosen_.assign(static_cast<std::size_t>(pieces_.lines()), Chosen{});
  for (int line = 0; line < pieces_.lines(); ++line) {
    Chosen& chosen = chosen_[static_cast<std::size_t>(line)];
    float best = -1e9F;
    float next = -1e9F;
    for (std::size_t i = pieces_.first_of(line); i < pieces_.first_of(line + 1); ++i) {
      const auto p = static_cast<std::size_t>(pieces_.link(i).piece);
      const float odds = std::max(log_odds_[i], traits_[p].log_odds - 4.0F);
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
    const float own = std::exp(log_odds_[static_cast<std::size_t>(chosen.candidate)]);
    const float other = chosen.rival_candidate < 0 ? 0.0F : std::exp(std::min(next, 20.0F));
    chosen.confidence = own / (1.0F + own + other);
    chosen.rival = other / (1.0F + own + other);
  }
}

}  // namespace striper::detail
