// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/evidence/frame_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace striper::detail {
namespace {

constexpr float kLargestOff = 3.0F;
constexpr float kLargestBend = 1.5F;
constexpr float kLeastWidth = PieceTraits::kLeastWidth;
constexpr float kLeastSpread = 0.5F;  // Of the background's log heights.

void add_piece(const FrameEvidence::Frame& frame, std::size_t piece, Evidence& e) noexcept {
  const PieceTraits::Trait& t = frame.traits.of_piece(piece);
  const Piece& p = frame.pieces.pieces()[piece];
  e.of[Evidence::kLength] = fast_log2(static_cast<float>(p.count));
  e.of[Evidence::kSupport] = fast_log2(static_cast<float>(p.support));
  e.of[Evidence::kRoughness] = t.roughness;
  e.of[Evidence::kBends] = t.bends;
  const bool has_width = t.width > kLeastWidth;
  e.of[Evidence::kWidth] = has_width ? fast_log2(t.width / frame.traits.width_scale()) : 0.0F;
  e.of[Evidence::kWidthSpread] = t.width_spread;
  e.of[Evidence::kHeight] = t.height - frame.traits.main_height();
  e.of[Evidence::kHeightChange] = t.height_change;
  e.of[Evidence::kTilt] = t.tilt;
  e.of[Evidence::kSnr] = t.snr;
  e.of[Evidence::kClipped] = t.clipped;
  e.of[Evidence::kHeightSpread] = t.height_spread;
  e.of[Evidence::kLightSpread] = t.light_spread;
  e.of[Evidence::kLightFollows] = t.follows;
  e.of[Evidence::kLight] = t.light;
  e.of[Evidence::kLightOff] = t.light - frame.traits.main_light();
  const bool has_gain = t.gain > 0.5F * Evidence::kUnknown;
  e.of[Evidence::kGain] = has_gain ? t.gain - frame.traits.main_gain() : Evidence::kUnknown;
  e.of[Evidence::kMisfit] = t.misfit;
  e.of[Evidence::kTexture] = t.texture;
  e.of[Evidence::kCoverage] = frame.traits.coverage();
  e.of[Evidence::kClutter] = frame.traits.clutter();
  e.of[Evidence::kHidden] = frame.context.is_hidden ? 1.0F : 0.0F;
  e.of[Evidence::kWidthKnown] = frame.context.is_width_known ? 1.0F : 0.0F;
}

void add_rivals(const FrameEvidence::Frame& frame, std::size_t candidate, Evidence& e) noexcept {
  constexpr float kMostAway = 6.0F;  // Log of widths: none.
  const Candidate& c = frame.pieces.candidate(candidate);
  const std::size_t first = frame.pieces.first_of(c.line);
  const std::size_t last = frame.pieces.first_of(c.line + 1);
  std::size_t higher = 0;
  float highest = 0.0F;
  float nearest = std::numeric_limits<float>::max();
  for (std::size_t i = first; i < last; ++i) {
    if (i == candidate) continue;
    const Candidate& other = frame.pieces.candidate(i);
    higher += static_cast<std::size_t>(other.amplitude > c.amplitude);
    highest = std::max(highest, other.amplitude);
    nearest = std::min(nearest, std::abs(other.across - c.across));
  }
  const float expected = frame.traits.expected_at(c);
  e.of[Evidence::kOwnRank] = static_cast<float>(higher);
  e.of[Evidence::kOwnRivals] = static_cast<float>(last - first);
  const bool has_rival = last - first > 1;
  e.of[Evidence::kOwnRivalHeight] =
      has_rival ? fast_log2(c.amplitude / highest) : -Evidence::kUnknown;
  e.of[Evidence::kOwnRivalAway] =
      has_rival ? std::min(kMostAway, fast_log2(std::max(nearest, kLeastWidth) / expected))
                : kMostAway;
}

}  // namespace

void FrameEvidence::reserve(const StripePieces& pieces) {
  next_.reserve(pieces.most());
  heights_.reserve(pieces.most());
  heights_near_.reserve(pieces.most());
  mean_about_.reserve(pieces.most());
  first_.reserve(pieces);
  second_.reserve(pieces);
  impression_.reserve(pieces.most());
}

void FrameEvidence::begin(const Frame& frame) {
  const std::size_t size = frame.pieces.size();
  heights_.resize(size);
  for (std::size_t i = 0; i < size; ++i) heights_[i] = frame.traits.of_candidate(i).height;
  mean_about_.find(frame.pieces, heights_, Evidence::kUnknown, heights_near_);
  next_.assign(size, -1);
  for (std::size_t i = 0; i < size; ++i) {
    const std::int32_t before = frame.pieces.link(i).before;
    if (before >= 0) next_[static_cast<std::size_t>(before)] = static_cast<std::int32_t>(i);
  }
}

void FrameEvidence::hear_first(const Frame& frame, const std::vector<float>& odds) {
  first_.sum_up(frame.pieces, odds);
  impression_.sum_up(frame.pieces, frame.traits, heights_, first_);
}

void FrameEvidence::hear_second(const Frame& frame, const std::vector<float>& odds) {
  second_.sum_up(frame.pieces, odds);
}

Evidence FrameEvidence::for_first(const Frame& frame, std::size_t candidate) const noexcept {
  Evidence e;
  add_piece(frame, static_cast<std::size_t>(frame.pieces.link(candidate).piece), e);
  add_own(frame, candidate, e);
  return e;
}

Evidence FrameEvidence::for_second(const Frame& frame, std::size_t candidate) const noexcept {
  Evidence e = for_first(frame, candidate);
  add_first(frame, candidate, e);
  return e;
}

Evidence FrameEvidence::for_third(const Frame& frame, std::size_t candidate) const noexcept {
  Evidence e = for_second(frame, candidate);
  add_second(frame, candidate, e);
  return e;
}

// Of the background, from a candidate to those beside it in its piece.
float FrameEvidence::level_step(const Frame& frame, std::size_t candidate) const noexcept {
  const auto level = [&](std::size_t i) {
    const PieceTraits::Look& look = frame.traits.of_candidate(i);
    return look.height - look.light;
  };
  float step = 0.0F;
  for (const std::int32_t beside : {frame.pieces.link(candidate).before, next_[candidate]}) {
    if (beside < 0) continue;
    step = std::max(step, std::abs(level(static_cast<std::size_t>(beside)) - level(candidate)));
  }
  return step;
}

void FrameEvidence::add_own(const Frame& frame, std::size_t candidate, Evidence& e) const noexcept {
  const Candidate& c = frame.pieces.candidate(candidate);
  const Link& link = frame.pieces.link(candidate);
  const auto p = static_cast<std::size_t>(link.piece);
  const Piece& piece = frame.pieces.pieces()[p];
  const PieceTraits::Trait& t = frame.traits.of_piece(p);
  const PieceTraits::Look& look = frame.traits.of_candidate(candidate);
  const float width = frame.traits.width_of(c);
  e.of[Evidence::kOwnWidth] = c.is_clipped ? 0.0F : fast_log2(width);
  const bool has_width = !c.is_clipped && t.width > kLeastWidth;
  e.of[Evidence::kOwnWidthOfPiece] =
      has_width ? std::abs(fast_log2(width * frame.traits.width_scale() / t.width)) : 0.0F;
  e.of[Evidence::kOwnBend] = std::min(std::abs(link.bend), kLargestBend);
  e.of[Evidence::kOwnOffNear] = std::min(frame.pieces.off_line(candidate).near, kLargestOff);
  e.of[Evidence::kOwnOffFar] = std::min(frame.pieces.off_line(candidate).far, kLargestOff);
  const std::int32_t end = std::min(c.line - piece.first_line, piece.last_line - c.line);
  e.of[Evidence::kOwnEnd] = static_cast<float>(end);
  e.of[Evidence::kOwnHeight] = look.height - t.height;
  e.of[Evidence::kOwnSnr] = fast_log2(std::max(1.0F, c.snr));
  e.of[Evidence::kOwnTilt] = c.tilt;
  e.of[Evidence::kOwnMisfit] = look.misfit;
  e.of[Evidence::kOwnLight] = look.light;
  e.of[Evidence::kOwnLightOff] = look.light - t.light;
  const bool has_gain = look.gain > 0.5F * Evidence::kUnknown;
  e.of[Evidence::kOwnGain] = has_gain ? look.gain - frame.traits.main_gain() : Evidence::kUnknown;
  e.of[Evidence::kOwnSigma] =
      fast_log2(std::max(frame.scatter_px[candidate], c.sigma) / frame.traits.expected_at(c));
  e.of[Evidence::kOwnLevelStep] = level_step(frame, candidate);
  e.of[Evidence::kOwnSides] = look.sides;
  e.of[Evidence::kOwnTexture] = look.texture;
  add_rivals(frame, candidate, e);
  const float near = heights_near_[candidate];
  e.of[Evidence::kOwnHeightNear] = near > Evidence::kUnknown ? look.height - near : 0.0F;
}

void FrameEvidence::add_first(const Frame& frame, std::size_t candidate,
                              Evidence& e) const noexcept {
  const Candidate& c = frame.pieces.candidate(candidate);
  const PieceTraits::Look& look = frame.traits.of_candidate(candidate);
  const auto piece = static_cast<std::size_t>(frame.pieces.link(candidate).piece);
  const FirstImpression::PieceOdds& odds = impression_.of_piece(piece);
  const FirstImpression::StripeLook& stripe = impression_.stripe();
  const BackgroundPieces& background = impression_.background();
  e.of[Evidence::kFirst] = first_.odds(candidate);
  e.of[Evidence::kFirstOfPiece] = first_.of_piece(piece);
  e.of[Evidence::kFirstRival] = first_.rival(candidate);
  e.of[Evidence::kFirstPieceRival] = first_.rival_of_piece(piece);
  e.of[Evidence::kFirstCoverage] = stripe.coverage;
  e.of[Evidence::kFirstBefore] = odds.before;
  e.of[Evidence::kFirstAfter] = odds.after;
  const float width = fast_log2(frame.traits.width_of(c));
  e.of[Evidence::kFirstWidth] = c.is_clipped ? 0.0F : width - stripe.width;
  e.of[Evidence::kFirstHeight] = look.height - stripe.height;
  e.of[Evidence::kFirstLight] = look.light - stripe.light;
  const bool has_gain = look.gain > 0.5F * Evidence::kUnknown;
  e.of[Evidence::kFirstGain] = has_gain ? look.gain - stripe.gain : Evidence::kUnknown;
  e.of[Evidence::kFirstNear] = first_.near(candidate);
  e.of[Evidence::kFirstNearRival] = first_.near_rival(candidate);
  e.of[Evidence::kFirstOfJoined] = odds.of_joined;
  e.of[Evidence::kFirstJoined] = fast_log2(1.0F + odds.joined);
  e.of[Evidence::kFirstRunnerUp] = stripe.runner_up;
  const float above = look.height - background.height();
  e.of[Evidence::kFirstBackHeight] = above;
  e.of[Evidence::kFirstBackScore] = above / std::max(kLeastSpread, background.spread());
  e.of[Evidence::kFirstBackAsLong] = background.as_long_as(frame.pieces, piece);
  const LineSupport::Support& lines = first_.lines(candidate);
  const LineSupport::Support rival = first_.lines_of_rivals(frame.pieces, candidate);
  e.of[Evidence::kLineFar] = lines.far;
  e.of[Evidence::kLineNear] = lines.near;
  e.of[Evidence::kLineHits] = lines.hits;
  e.of[Evidence::kLineStand] = lines.stand;
  e.of[Evidence::kLineFarRival] = rival.far;
  e.of[Evidence::kLineNearRival] = rival.near;
}

void FrameEvidence::add_second(const Frame& frame, std::size_t candidate,
                               Evidence& e) const noexcept {
  const auto piece = static_cast<std::size_t>(frame.pieces.link(candidate).piece);
  const LineSupport::Support& lines = second_.lines(candidate);
  const LineSupport::Support rival = second_.lines_of_rivals(frame.pieces, candidate);
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

}  // namespace striper::detail
