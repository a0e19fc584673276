// SPDX-License-Identifier: Apache-2.0
#include "stripe/learn/texture_scatter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <striper/core/return_status.hpp>
#include <striper/core/robust.hpp>

#include "core/pixel_box.hpp"
#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// Scan lines that get the same excess; with those of a block on either side, 24 scan lines are
// looked at. Fewer are mostly chance, more are another surface.
constexpr std::size_t kBlock = 8;
constexpr std::size_t kReach = 1;
constexpr int kLeastKnown = 5;

// Differences of scan lines two apart show grain of up to some 6 pixels. Farther apart they would
// show coarser grain, which moves a stripe less, and the kinks and edges of objects.
constexpr std::size_t kLag = 2;
constexpr float kPlaceParts = 70.0F;  // 1 + 16 + 36 + 16 + 1: of a fourth difference,
constexpr float kWidthParts = 6.0F;   // and 1 + 4 + 1 of a second one.
// Variances of a width in those of a place: 1 with white noise and a known background, more where
// the background is measured beside it and neighbours share their noise.
constexpr float kWidthNoise = 1.7F;
// And more by far of a stripe narrower than a pixel that stands where its width shows least: so
// much as the Fisher information of four parameters in white noise has it there, exp(.9 / sigma^2 -
// 1.25), to a tenth from .35 to .7 pixels.
constexpr float kResolved = 0.71F;  // Pixels; above, kWidthNoise is more.
constexpr float kNarrowest = 0.2F;

// The quantile of the squares that stands for all, so that the edges of objects do not count, and
// that quantile of chi squared with one degree of freedom.
constexpr float kQuantile = 0.65F;
constexpr float kQuantileOfSquare = 0.874F;
// So many times what noise makes may be chance, in some twenty squares that are not independent: by
// 2 the sigmas of a stripe on a plain wall come out 3 % too large, by 3 less than 1 %.
constexpr float kChance = 3.0F;
// How far a width may be from the expected one for other reasons: range, a surface that leans, a
// width that was learnt elsewhere.
constexpr float kOddWidth = 0.3F;
constexpr float kJump = 1.0F;  // Widths.
// No texture moves the middle farther, in widths: as far as a step from black to white.
constexpr double kMost = 0.8;

float square(float x) { return x * x; }

// Of a stripe of that sigma, pixels of the image.
float width_noise(float sigma) {
  if (!(sigma < kResolved)) return kWidthNoise;
  return std::exp(0.9F / square(std::max(kNarrowest, sigma)) - 1.25F);
}

}  // namespace

void TextureScatter::add(const WidthModel& width, bool is_width_known, const AxisGrid& across,
                         Stripe& stripe) {
  if (stripe.size() != static_cast<std::size_t>(stripe.line_count) || stripe.size() == 0) return;
  collect(width, across, stripe);
  look_at_places();
  look_at_widths();
  if (is_width_known) look_at_expected();
  const double most = kMost * typical_width(width) * across.step;
  const auto most2 = static_cast<float>(most * most);
  for (std::size_t block = 0; block < excess_.size(); ++block) {
    if (!(excess_[block] > 0.0F)) continue;
    const float added = std::min(most2, excess_[block]);
    const std::size_t end = std::min(stripe.size(), (block + 1) * kBlock);
    for (std::size_t i = block * kBlock; i < end; ++i) {
      stripe.sigma_px[i] = std::sqrt(square(stripe.sigma_px[i]) + added);
    }
  }
}

void TextureScatter::collect(const WidthModel& width, const AxisGrid& across,
                             const Stripe& stripe) {
  const std::size_t size = stripe.size();
  const std::size_t blocks = (size + kBlock - 1) / kBlock;
  for (auto* values :
       {&across_, &width_, &variance_, &width_variance_, &odd_width_, &squared_, &allowed_}) {
    values->resize(blocks * kBlock, kNone);
  }
  excess_.assign(blocks, 0.0F);
  beyond_.resize(blocks);
  known_.resize(blocks);
  scratch_.reserve((2 * kReach + 1) * kBlock);
  const auto pivot = static_cast<float>(across.sensor(width.pivot));
  const auto slope = static_cast<float>(width.slope);
  const double at_pivot = without_pixel_box(width.at_pivot);
  const auto own = static_cast<float>(at_pivot * across.step);
  float* const x = across_.data();
  float* const w = width_.data();
  float* const v = variance_.data();
  float* const odd = odd_width_.data();
  const auto step = static_cast<float>(across.step);
  for (std::size_t i = 0; i < size; ++i) {
    const float none = stripe.status[i] == ReturnStatus::kOk ? 0.0F : kNone;
    x[i] = static_cast<float>(stripe.across_px[i]) + none;
    w[i] = stripe.width_px[i] + none;
    v[i] = square(stripe.sigma_px[i]);
    const float expected = own + slope * (x[i] - pivot);
    width_variance_[i] = v[i] * width_noise(expected / step);
    odd[i] = std::max(0.0F, std::abs(w[i] - expected) - kOddWidth * expected) + none;
  }
  for (std::size_t i = size; i < blocks * kBlock; ++i) x[i] = w[i] = odd[i] = kNone;
  part_surfaces(kJump * own);
}

// Where the stripe jumps by a width it goes on on another surface, and what is right beside is of
// both.
void TextureScatter::part_surfaces(float jump) {
  const std::size_t size = across_.size();
  surface_.resize(size);
  const float* const x = across_.data();
  float* const surface = surface_.data();
  surface[0] = 0.0F;
  surface[size - 1] = 0.0F;
  for (std::size_t i = 1; i + 1 < size; ++i) {
    surface[i] = std::abs(x[i - 1] - 2.0F * x[i] + x[i + 1]) > jump ? 1.0F : 0.0F;
  }
  float count = 0.0F;
  for (std::size_t i = 0; i < size; ++i) {
    const bool is_break = surface[i] > 0.0F;
    count += surface[i];
    surface[i] = count;
    if (is_break) across_[i] = width_[i] = odd_width_[i] = kNone;
  }
}

// Fourth differences: no straight or gently bent surface shows in them.
void TextureScatter::look_at_places() {
  const float* const x = across_.data();
  const float* const v = variance_.data();
  const float* const surface = surface_.data();
  float* const squared = squared_.data();
  float* const allowed = allowed_.data();
  std::fill(squared_.begin(), squared_.end(), kNone);
  for (std::size_t m = 0; m + 4 * kLag < across_.size(); ++m) {
    const std::size_t a = m + kLag;
    const std::size_t i = a + kLag;
    const std::size_t b = i + kLag;
    const std::size_t n = b + kLag;
    const float bend = x[m] + x[n] - 4.0F * (x[a] + x[b]) + 6.0F * x[i];
    squared[i] = surface[m] == surface[n] ? square(bend) : kNone;
    allowed[i] = v[m] + v[n] + 16.0F * (v[a] + v[b]) + 36.0F * v[i];
  }
  take_excess(kPlaceParts);
}

void TextureScatter::look_at_widths() {
  const float* const w = width_.data();
  const float* const v = width_variance_.data();
  const float* const surface = surface_.data();
  float* const squared = squared_.data();
  float* const allowed = allowed_.data();
  std::fill(squared_.begin(), squared_.end(), kNone);
  for (std::size_t a = 0; a + 2 * kLag < width_.size(); ++a) {
    const std::size_t i = a + kLag;
    const std::size_t b = i + kLag;
    const float bend = w[a] - 2.0F * w[i] + w[b];
    squared[i] = surface[a] == surface[b] ? square(bend) : kNone;
    allowed[i] = v[a] + 4.0F * v[i] + v[b];
  }
  take_excess(kWidthParts);
}

void TextureScatter::look_at_expected() {
  for (std::size_t i = 0; i < width_.size(); ++i) {
    squared_[i] = square(odd_width_[i]);
    allowed_[i] = width_variance_[i];
  }
  take_excess(1.0F);
}

void TextureScatter::take_excess(float parts) {
  const float* const squared = squared_.data();
  const float* const allowed = allowed_.data();
  const std::size_t blocks = excess_.size();
  for (std::size_t block = 0; block < blocks; ++block) {
    int beyond = 0;
    int known = 0;
    for (std::size_t i = block * kBlock; i < (block + 1) * kBlock; ++i) {
      beyond += static_cast<int>(squared[i] > kChance * kQuantileOfSquare * allowed[i]);
      known += static_cast<int>(squared[i] >= 0.0F);
    }
    beyond_[block] = beyond;
    known_[block] = known;
  }
  for (std::size_t block = 0; block < blocks; ++block) {
    int beyond = 0;
    int known = 0;
    const std::size_t first = block > kReach ? block - kReach : 0;
    const std::size_t last = std::min(blocks - 1, block + kReach);
    for (std::size_t b = first; b <= last; ++b) {
      beyond += beyond_[b];
      known += known_[b];
    }
    const bool is_chance = static_cast<float>(beyond) <= (1.0F - kQuantile) * known;
    if (is_chance || known < kLeastKnown) continue;
    excess_[block] = std::max(excess_[block], excess_about(first, last) / parts);
  }
}

float TextureScatter::excess_about(std::size_t first, std::size_t last) {
  scratch_.clear();
  for (std::size_t i = first * kBlock; i < (last + 1) * kBlock; ++i) {
    if (!(squared_[i] >= 0.0F)) continue;
    scratch_.push_back(squared_[i] / kQuantileOfSquare - allowed_[i]);
  }
  if (scratch_.empty()) return 0.0F;
  const auto at = static_cast<std::size_t>(kQuantile * static_cast<float>(scratch_.size() - 1));
  return std::max(0.0F, nth_smallest(scratch_, at));
}

}  // namespace striper::detail
