// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/piece_traits.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/profile/line_view.hpp"
#include "stripe/select/evidence/evidence.hpp"
#include "stripe/select/profile_misfit.hpp"
#include "stripe/select/texture_beside.hpp"

namespace striper::detail {
namespace {

// A rougher bend is no rougher: an edge, not a surface. Variances, and pixels.
constexpr float kRoughest = 50.0F;
constexpr float kLargestBend = 1.5F;
// What real surfaces bend by beyond noise, pixels: paint, paper, cloth.
constexpr float kSurfaceBend = 0.1F;
constexpr float kLargestTilt = 1.0F;
constexpr float kLargestChange = 2.0F;
constexpr float kLargestSnr = 64.0F;
constexpr float kLeastOfWidths = 0.3F;
constexpr float kLeastLevel_dn = 1.0F;
constexpr float kLeastTexture_dn = 0.25F;
constexpr float kMostTexture = 8.0F;  // Log: nothing to be seen.

// From sums of n numbers, of their squares or products.
float spread(float squares, float mean, float n) {
  return std::sqrt(std::max(0.0F, squares / n - mean * mean));
}

float expected_log_amplitude(const ChoiceContext& context, float across) {
  if (context.expected == nullptr || context.expected->amplitude_dn.empty()) {
    return Evidence::kUnknown;
  }
  const AxisGrid& grid = grid_across(context.frame->grid, context.axis);
  const std::vector<float>& dn = context.expected->amplitude_dn;
  const auto at = std::lround(grid.sensor(static_cast<double>(across)));
  const auto last = static_cast<long>(dn.size()) - 1;
  const float there = dn[static_cast<std::size_t>(std::clamp(at, 0L, last))];
  return there > 0.0F ? fast_log2(there) : Evidence::kUnknown;
}

}  // namespace

float logistic(float x) noexcept { return 1.0F / (1.0F + std::exp(-x)); }

void PieceTraits::reserve(std::size_t most) {
  traits_.reserve(most);
  looks_.reserve(most);
}

void PieceTraits::sum_up(const StripePieces& pieces, const ChoiceContext& context) {
  width_ = context.width;
  looks_.assign(pieces.size(), Look{});
  traits_.assign(pieces.pieces().size(), Trait{});
  add_candidates(pieces, context);
  finish(pieces);
  find_main_pieces(pieces, context);
  measure_frame(pieces);
}

void PieceTraits::look_closer(const StripePieces& pieces, const ChoiceContext& context) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Candidate& c = pieces.candidate(i);
    Look& look = looks_[i];
    const float white = expected_log_amplitude(context, c.across);
    look.gain = white > Evidence::kUnknown ? look.height - white : Evidence::kUnknown;
    const ProfileMisfit misfit = misfit_of(*context.frame, context.axis, c);
    look.misfit = misfit.residual;
    look.sides = misfit.sides;
    const float texture_dn =
        texture_beside(*context.frame, context.axis, c.line, c.across, c.width);
    look.texture =
        std::min(look.height - fast_log2(std::max(kLeastTexture_dn, texture_dn)), kMostTexture);
    Trait& t = traits_[static_cast<std::size_t>(pieces.link(i).piece)];
    t.gain += look.gain;
    t.misfit += look.misfit;
    t.texture += look.texture;
  }
  float lines = 0.0F;
  main_gain_ = 0.0F;
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    Trait& t = traits_[p];
    const auto count = static_cast<float>(pieces.pieces()[p].count);
    t.gain /= count;
    t.misfit /= count;
    t.texture /= count;
    lines += count * likeness(p);
    main_gain_ += count * likeness(p) * t.gain;
  }
  if (lines > 0.0F) main_gain_ /= lines;
}

void PieceTraits::add_candidates(const StripePieces& pieces, const ChoiceContext& context) {
  const auto pivot_width = static_cast<float>(context.width.at(0.0));
  const auto slope = static_cast<float>(context.width.slope);
  // Candidates of one piece mostly follow each other: their sums are kept in a local, which nothing
  // aliases.
  Trait t;
  std::int32_t piece = -1;
  const auto put_away = [&] {
    if (piece >= 0) traits_[static_cast<std::size_t>(piece)] = t;
  };
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Candidate& c = pieces.candidate(i);
    const Link& link = pieces.link(i);
    Look& look = looks_[i];
    if (link.piece != piece) {
      put_away();
      piece = link.piece;
      t = traits_[static_cast<std::size_t>(piece)];
    }
    const float level = fast_log2(std::max(kLeastLevel_dn, c.list->level[c.at] - context.black_dn));
    look.height = fast_log2(c.amplitude);
    look.light = look.height - level;
    t.height += look.height;
    t.height_spread += look.height * look.height;
    t.light += look.light;
    t.light_spread += look.light * look.light;
    t.level += level;
    t.levels += level * level;
    t.follows += level * look.height;
    t.tilt += std::min(c.tilt, kLargestTilt);
    t.snr += std::min(c.snr, kLargestSnr);
    if (c.is_clipped) {
      t.clipped += 1.0F;
    } else {
      t.width += std::min(c.width / (pivot_width + slope * c.across), 4.0F);
      t.seen_widths += 1.0F;
    }
    if (link.before < 0) continue;
    const Candidate& b = pieces.candidate(static_cast<std::size_t>(link.before));
    t.height_change += std::min(std::abs(c.amplitude - b.amplitude) / b.amplitude, kLargestChange);
    if (!c.is_clipped && !b.is_clipped) {
      t.width_spread += std::min(std::abs(c.width - b.width) / b.width, 1.0F);
    }
    if (!(link.bend_variance > 0.0F)) continue;
    const float most = std::min(std::abs(link.bend), kLargestBend);
    t.bends += most * most - link.bend_variance;
    const float allowed = link.bend_variance + kSurfaceBend * kSurfaceBend;
    t.roughness += std::min(link.bend * link.bend / allowed, kRoughest);
  }
  put_away();
}

void PieceTraits::finish(const StripePieces& pieces) {
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    Trait& t = traits_[p];
    const auto count = static_cast<float>(pieces.pieces()[p].count);
    const float links = std::max(1.0F, count - 1.0F);
    const float bends = std::max(1.0F, count - 2.0F);
    for (float* mean : {&t.height, &t.light, &t.level, &t.tilt, &t.clipped}) {
      *mean /= count;
    }
    t.height_spread = spread(t.height_spread, t.height, count);
    t.light_spread = spread(t.light_spread, t.light, count);
    t.levels = spread(t.levels, t.level, count);
    constexpr float kNoSpread = 0.02F;  // What the logarithm is good to.
    const float spreads = (t.levels + kNoSpread) * (t.height_spread + kNoSpread);
    t.follows = (t.follows / count - t.level * t.height) / spreads;
    t.snr = fast_log2(std::max(1.0F, t.snr / count));
    // What is not clipped of a clipped piece is its ends and what is darker: no sample of it.
    const bool shows_width = t.seen_widths > kLeastOfWidths * count;
    t.width = shows_width ? t.width / t.seen_widths : 0.0F;
    t.height_change /= links;
    t.width_spread /= links;
    t.bends = std::sqrt(std::max(0.0F, t.bends / bends));
    t.roughness = fast_log2(1.0F + t.roughness / bends);
  }
}

// By eye: only what begins the search for the main pieces.
void PieceTraits::guess_pieces(const StripePieces& pieces, bool use_width) {
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    Trait& t = traits_[p];
    const auto count = static_cast<float>(pieces.pieces()[p].support);
    const bool has_width = use_width && t.width > 0.0F;
    const float off = has_width ? std::abs(fast_log2(t.width / width_scale_)) : 0.0F;
    t.first_guess = 1.2F * fast_log2(count) - 0.7F * t.roughness - 3.0F * t.bends - 4.0F * t.tilt +
                    0.5F * t.snr - 4.0F * off - 2.0F * t.width_spread - 4.0F;
  }
}

float PieceTraits::likeness(std::size_t piece) const noexcept {
  return logistic(traits_[piece].first_guess);
}

// Which pieces are about as the stripe is, whatever the frame; of the best of them the width, where
// it is not known.
void PieceTraits::find_main_pieces(const StripePieces& pieces, const ChoiceContext& context) {
  width_scale_ = 1.0F;
  guess_pieces(pieces, context.is_width_known);
  if (context.is_width_known) return;
  float best = 0.0F;
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    const Trait& t = traits_[p];
    const float merit = static_cast<float>(pieces.pieces()[p].count) * likeness(p);
    if (!(merit > best)) continue;
    best = merit;
    width_scale_ = t.width > 0.0F ? t.width : 1.0F;
  }
  guess_pieces(pieces, true);
  width_.at_pivot *= static_cast<double>(width_scale_);
  width_.slope *= static_cast<double>(width_scale_);
}

// What the frame shows as a whole: how high the main pieces are, how much of the scan lines they
// cover, and how much else there is.
void PieceTraits::measure_frame(const StripePieces& pieces) {
  float lines = 0.0F;
  float others = 0.0F;
  main_height_ = main_light_ = main_level_spread_ = 0.0F;
  for (std::size_t p = 0; p < traits_.size(); ++p) {
    const Trait& t = traits_[p];
    const auto count = static_cast<float>(pieces.pieces()[p].count);
    const float main = count * likeness(p);
    lines += main;
    main_height_ += main * t.height;
    main_light_ += main * t.light;
    main_level_spread_ += main * t.levels;
    others += count - main;
  }
  for (float* mean : {&main_height_, &main_light_, &main_level_spread_}) {
    *mean = lines > 0.0F ? *mean / lines : 0.0F;
  }
  const auto all = static_cast<float>(std::max(1, pieces.lines()));
  coverage_ = std::min(1.0F, lines / all);
  clutter_ = fast_log2(1.0F + others / all);
}

}  // namespace striper::detail
