// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/stripe_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace striper::detail {
namespace {

// Two candidates of a scan line nearer than this, in widths, are one peak.
constexpr float kSamePeak = 1.0F;
// A stripe steeper than that, pixels per scan line, is smeared too wide to be measured.
constexpr float kSteepest = 3.0F;
// Of a piece so long the direction is known, as the mean over about the last so many steps; and
// from there it bends by at most so many pixels, and by half of a steep one's slope.
constexpr std::int32_t kKnowsItsSlope = 5;
constexpr float kSlopeGain = 0.3F;
constexpr float kMostBend = 1.2F;
// Pieces of at least so many candidates are joined beyond gaps of at most so many scan lines, where
// a straight line meets both ends and their directions agree, pixels per scan line.
constexpr std::int32_t kLeastToJoin = 5;
constexpr std::int32_t kMostGap = 96;
constexpr int kForSlope = 24;
constexpr float kMostApart = 0.7F;
constexpr float kMostApartPerLine = 0.03F;
constexpr float kMostTurn = 0.15F;
// Scan lines that a piece bridges: those a thin wire or a hot pixel hides.
constexpr int kMostBridged = 2;
// One over so many scan lines: from a candidate to the next.
constexpr std::array kPerLines{0.0F, 1.0F, 1.0F / 2.0F, 1.0F / 3.0F};
static_assert(kPerLines.size() == kMostBridged + 2);
// From one scan line to the next on one surface: reflectance edges change the height by so much,
// and noise the width.
constexpr float kMostHeightRatio = 3.0F;
constexpr float kMostWidthRatio = 1.8F;
// From white paper to black ink, where the position hardly changes.
constexpr float kMostInkRatio = 30.0F;
constexpr float kSameSurface = 1.2F;

bool is_like(const Candidate& a, const Candidate& b) {
  const bool is_level = std::abs(a.across - b.across) < kSameSurface;
  const float ratio = is_level ? kMostInkRatio : kMostHeightRatio;
  const bool is_as_high = a.amplitude < ratio * b.amplitude && b.amplitude < ratio * a.amplitude;
  const bool is_as_wide =
      a.width < kMostWidthRatio * b.width && b.width < kMostWidthRatio * a.width;
  return is_as_high && (is_as_wide || a.is_clipped || b.is_clipped);
}

}  // namespace

void StripePieces::find(const PeakCandidates& candidates, const WidthModel& width,
                        float threshold) {
  gather(candidates, width, threshold);
  links_.assign(candidates_.size(), Link{});
  off_line_.clear();
  next_.assign(candidates_.size(), -1);
  next_distance_.resize(candidates_.size());
  for (int line = 1; line < lines(); ++line) link_line(line);
  number_pieces();
  join_pieces();
}

void StripePieces::gather(const PeakCandidates& candidates, const WidthModel& width,
                          float threshold) {
  const std::size_t lines = candidates.primary.size();
  const std::size_t most = lines + candidates.secondary.seeds.capacity();
  candidates_.clear();
  candidates_.reserve(most);
  links_.reserve(most);
  off_line_.reserve(most);
  jumps_.reserve(most);
  next_.reserve(most);
  next_distance_.reserve(most);
  pieces_.reserve(most);
  first_of_line_.resize(lines + 1);
  const std::vector<PeakSeed>& seeds = candidates.secondary.seeds;
  std::size_t extra = 0;
  for (std::size_t line = 0; line < lines; ++line) {
    first_of_line_[line] = static_cast<std::uint32_t>(candidates_.size());
    add(candidates.primary, line, width, threshold);
    for (; extra < seeds.size() && static_cast<std::size_t>(seeds[extra].line) == line; ++extra) {
      add(candidates.secondary, extra, width, threshold);
    }
  }
  first_of_line_[lines] = static_cast<std::uint32_t>(candidates_.size());
}

void StripePieces::add(const PeakList& list, std::size_t at, const WidthModel& width,
                       float threshold) {
  if (!(list.significance[at] >= threshold && list.amplitude[at] > 0.0F)) return;
  const auto across = static_cast<float>(list.position(at));
  const std::int32_t line = list.seeds[at].line;
  for (std::size_t i = candidates_.size(); i-- > 0 && candidates_[i].line == line;) {
    const auto near = kSamePeak * static_cast<float>(width.at(static_cast<double>(across)));
    if (std::abs(candidates_[i].across - across) < near) return;
  }
  Candidate& c = candidates_.emplace_back();  // In place: a copy of so many parts is slow.
  c.list = &list;
  c.at = static_cast<std::uint32_t>(at);
  c.line = line;
  c.across = across;
  c.sigma = list.sigma[at];
  c.amplitude = list.amplitude[at];
  c.width = list.width[at];
  c.snr = list.snr[at];
  c.tilt = std::abs(list.slope[at]) * c.width / c.amplitude;
  c.is_clipped = list.clipped[at] > 0.0F;
}

void StripePieces::link_line(int line) {
  for (std::size_t i = first_of(line); i < first_of(line + 1); ++i) link_candidate(i);
}

// Who loses its predecessor to a nearer one begins a piece.
void StripePieces::link_candidate(std::size_t i) {
  const Link before = links_[i];
  if (before.before >= 0 || !take_predecessor(i)) return;
  bend_at(i);
}

bool StripePieces::take_predecessor(std::size_t i) {
  const Candidate& own = candidates_[i];
  for (int gap = 1; gap <= 1 + kMostBridged && own.line - gap >= 0; ++gap) {
    std::int32_t nearest = -1;
    float distance = kSteepest * static_cast<float>(gap);
    for (std::size_t p = first_of(own.line - gap); p < first_of(own.line - gap + 1); ++p) {
      const float apart = distance_between(p, own, static_cast<float>(gap));
      const bool is_taken = next_[p] >= 0 && (gap > 1 || next_distance_[p] <= apart);
      if (apart > distance || is_taken || !is_like(candidates_[p], own)) continue;
      nearest = static_cast<std::int32_t>(p);
      distance = apart;
    }
    if (nearest < 0) continue;
    const auto p = static_cast<std::size_t>(nearest);
    if (next_[p] >= 0) links_[static_cast<std::size_t>(next_[p])] = Link{};
    next_[p] = static_cast<std::int32_t>(i);
    next_distance_[p] = distance;
    links_[i].before = nearest;
    return true;
  }
  return false;
}

// From where the piece of candidate p leads to; infinite beyond what a surface bends by there.
float StripePieces::distance_between(std::size_t p, const Candidate& own, float gap) const {
  const Link& link = links_[p];
  const float step = own.across - candidates_[p].across;
  if (link.count < kKnowsItsSlope) return std::abs(step);
  const float off = std::abs(step - link.slope * gap);
  const float most = kMostBend + 0.5F * std::abs(link.slope) * gap;
  return off <= most ? off : std::numeric_limits<float>::infinity();
}

void StripePieces::bend_at(std::size_t i) {
  Link& link = links_[i];
  const auto p = static_cast<std::size_t>(link.before);
  const Link& before = links_[p];
  const Candidate& b = candidates_[p];
  const Candidate& c = candidates_[i];
  const float per_second = kPerLines[static_cast<std::size_t>(c.line - b.line)];
  const float step = per_second * (c.across - b.across);
  link.count = before.count + 1;
  link.slope = link.count == 2 ? step : before.slope + kSlopeGain * (step - before.slope);
  if (before.before < 0) return;
  const Candidate& a = candidates_[static_cast<std::size_t>(before.before)];
  const float per_first = kPerLines[static_cast<std::size_t>(b.line - a.line)];
  link.bend = step - per_first * (b.across - a.across);
  const float at_a = per_first * a.sigma;
  const float at_b = (per_first + per_second) * b.sigma;
  const float at_c = per_second * c.sigma;
  link.bend_variance = at_a * at_a + at_b * at_b + at_c * at_c;
}

// The candidates 2, 4, 8 and 16 before a candidate are those before the ones before it; and each
// candidate has been passed by once there is one eight beyond it.
void StripePieces::measure_off_line() {
  off_line_.assign(candidates_.size(), OffLine{});
  jumps_.resize(candidates_.size());
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    jumps_[i] = jumps_from(i);
    const Jumps& jumps = jumps_[i];
    const auto own = static_cast<std::int32_t>(i);
    if (jumps[1] >= 0) {
      off_line_[static_cast<std::size_t>(jumps[0])].near = off(jumps[0], jumps[1], own);
    }
    if (jumps[3] >= 0) {
      off_line_[static_cast<std::size_t>(jumps[2])].far = off(jumps[2], jumps[3], own);
    }
  }
}

StripePieces::Jumps StripePieces::jumps_from(std::size_t i) const {
  Jumps jumps{-1, -1, -1, -1};
  std::int32_t at = links_[i].before;
  for (std::size_t level = 0; level < jumps.size() && at >= 0; ++level) {
    const auto there = static_cast<std::size_t>(at);
    at = level == 0 ? links_[there].before : jumps_[there][level - 1];
    jumps[level] = at;
  }
  return jumps;
}

float StripePieces::off(std::int32_t middle, std::int32_t before, std::int32_t after) const {
  const Candidate& a = candidates_[static_cast<std::size_t>(before)];
  const Candidate& b = candidates_[static_cast<std::size_t>(middle)];
  const Candidate& c = candidates_[static_cast<std::size_t>(after)];
  const float part = static_cast<float>(b.line - a.line) / static_cast<float>(c.line - a.line);
  return std::abs(b.across - a.across - part * (c.across - a.across));
}

void StripePieces::number_pieces() {
  pieces_.clear();
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    Link& link = links_[i];
    const std::int32_t line = candidates_[i].line;
    if (link.before < 0) {
      link.piece = static_cast<std::int32_t>(pieces_.size());
      const auto first = static_cast<std::int32_t>(i);
      pieces_.push_back({line, line, first, first, 1, -1, 0});
      continue;
    }
    link.piece = links_[static_cast<std::size_t>(link.before)].piece;
    Piece& piece = pieces_[static_cast<std::size_t>(link.piece)];
    piece.last_line = line;
    piece.last = static_cast<std::int32_t>(i);
    ++piece.count;
  }
}

float StripePieces::slope_before(std::int32_t candidate) const {
  auto at = static_cast<std::size_t>(candidate);
  for (int n = 0; n < kForSlope && links_[at].before >= 0; ++n) {
    at = static_cast<std::size_t>(links_[at].before);
  }
  const Candidate& end = candidates_[static_cast<std::size_t>(candidate)];
  const Candidate& begin = candidates_[at];
  return (end.across - begin.across) / static_cast<float>(std::max(1, end.line - begin.line));
}

float StripePieces::slope_after(std::int32_t candidate) const {
  auto at = static_cast<std::size_t>(candidate);
  for (int n = 0; n < kForSlope && next_[at] >= 0; ++n) at = static_cast<std::size_t>(next_[at]);
  const Candidate& begin = candidates_[static_cast<std::size_t>(candidate)];
  const Candidate& end = candidates_[at];
  return (end.across - begin.across) / static_cast<float>(std::max(1, end.line - begin.line));
}

// Whether a straight line joins the end of a piece and the beginning of another.
bool StripePieces::goes_on(const Piece& from, const Piece& to, float& apart) const {
  const Candidate& end = candidates_[static_cast<std::size_t>(from.last)];
  const Candidate& begin = candidates_[static_cast<std::size_t>(to.first)];
  const auto gap = static_cast<float>(to.first_line - from.last_line);
  const float step = begin.across - end.across;
  const float most = kMostApart + kMostApartPerLine * gap;
  const float slope_before_gap = slope_before(from.last);
  const float slope_after_gap = slope_after(to.first);
  if (std::abs(slope_after_gap - slope_before_gap) > kMostTurn) return false;
  apart = std::abs(step - 0.5F * (slope_before_gap + slope_after_gap) * gap);
  return apart <= most;
}

void StripePieces::join_pieces() {
  for (std::size_t q = 0; q < pieces_.size(); ++q) {
    Piece& to = pieces_[q];
    to.support = to.count;
    if (to.count < kLeastToJoin) continue;
    float nearest = std::numeric_limits<float>::infinity();
    for (std::size_t p = 0; p < q; ++p) {
      const Piece& from = pieces_[p];
      const std::int32_t gap = to.first_line - from.last_line;
      if (from.count < kLeastToJoin || gap <= 0 || gap > kMostGap) continue;
      float apart = 0.0F;
      if (!goes_on(from, to, apart) || apart >= nearest) continue;
      nearest = apart;
      to.before = static_cast<std::int32_t>(p);
    }
    if (to.before >= 0) to.support += pieces_[static_cast<std::size_t>(to.before)].support;
  }
  for (std::size_t q = pieces_.size(); q-- > 0;) {
    const Piece& to = pieces_[q];
    if (to.before < 0) continue;
    Piece& from = pieces_[static_cast<std::size_t>(to.before)];
    from.support = std::max(from.support, to.support);
  }
}

}  // namespace striper::detail
