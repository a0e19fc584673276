// SPDX-License-Identifier: Apache-2.0
#include "stripe/report/patches/return_patch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "stripe/profile/line_view.hpp"
#include "stripe/report/line_odds.hpp"

namespace striper::detail {
namespace {

constexpr int kSide = ReturnPatch::kSide;
constexpr int kHalf = kSide / 2;

// In heights of the return: beyond it is other things that differ.
constexpr float kDarkest = -3.0F;
constexpr float kBrightest = 4.0F;
// A return is at least so high, of full scale.
constexpr float kLeastHeight = 1.0F / 2000.0F;
// Log odds that are a unit of the patch.
constexpr float kOddsUnit = 5.0F;

// Of the image: its scan lines, and the pixels of each.
struct Place {
  int line;
  int across;
};

template <typename Pixel>
void look_at_image(const RatedFrame& rated, const Place& centre, ReturnPatch& patch) {
  const LitFrame& frame = rated.frame;
  const StripeAxis axis = rated.stripe.axis;
  const int lines = line_count(frame.lit, axis);
  for (int along = 0; along < kSide; ++along) {
    const int line = std::clamp(centre.line - kHalf + along, 0, lines - 1);
    const LitLine<Pixel> pixels(frame, axis, line);
    for (int across = 0; across < kSide; ++across) {
      const int at = std::clamp(centre.across - kHalf + across, 0, pixels.length() - 1);
      patch.row(ReturnPatch::kImage, static_cast<std::size_t>(across))[along] =
          static_cast<float>(pixels.value(at));
    }
  }
}

float median_of(const ReturnPatch& patch) {
  std::array<float, kSide * kSide> pixels;
  std::copy_n(patch.of.data(), pixels.size(), pixels.data());
  float* const middle = pixels.data() + pixels.size() / 2;
  std::nth_element(pixels.data(), middle, pixels.data() + pixels.size());
  return *middle;
}

// Above their median and in the return's heights; nothing beyond the image's borders.
void scale(const RatedFrame& rated, const Place& centre, float height_dn, ReturnPatch& patch) {
  const float median = median_of(patch);
  const StripeAxis axis = rated.stripe.axis;
  const int lines = line_count(rated.frame.lit, axis);
  const int length = line_length(rated.frame.lit, axis);
  for (int across = 0; across < kSide; ++across) {
    float* const row = patch.row(ReturnPatch::kImage, static_cast<std::size_t>(across));
    const int at = centre.across - kHalf + across;
    for (int along = 0; along < kSide; ++along) {
      const int line = centre.line - kHalf + along;
      const bool is_inside = at >= 0 && at < length && line >= 0 && line < lines;
      const float value = std::clamp((row[along] - median) / height_dn, kDarkest, kBrightest);
      row[along] = is_inside ? value : 0.0F;
    }
  }
}

// The one or two pixels of each scan line that its return is in.
void draw_returns(const RatedFrame& rated, const Place& centre, ReturnPatch& patch) {
  const int lines = line_count(rated.frame.lit, rated.stripe.axis);
  const int length = line_length(rated.frame.lit, rated.stripe.axis);
  std::fill(patch.row(ReturnPatch::kReturn, 0), patch.row(ReturnPatch::kPlanes, 0), 0.0F);
  for (int along = 0; along < kSide; ++along) {
    const int line = centre.line - kHalf + along;
    if (line < 0 || line >= lines) continue;
    const float odds = rated.odds[static_cast<std::size_t>(line)];
    if (!(odds > kNoReturn)) continue;
    const double position = rated.position(static_cast<std::size_t>(line));
    const int first = static_cast<int>(std::floor(position));
    for (const int at : {first, first + 1}) {
      const int across = at - centre.across + kHalf;
      if (across < 0 || across >= kSide || at < 0 || at >= length) continue;
      const auto part = static_cast<float>(1.0 - std::abs(at - position));
      patch.row(ReturnPatch::kReturn, static_cast<std::size_t>(across))[along] = part;
      patch.row(ReturnPatch::kRated, static_cast<std::size_t>(across))[along] =
          part * odds / kOddsUnit;
    }
  }
}

}  // namespace

double RatedFrame::position(std::size_t line) const noexcept {
  return grid_across(frame.grid, stripe.axis).index(stripe.across_px[line]);
}

void look_about(const RatedFrame& rated, std::size_t line, ReturnPatch& patch) noexcept {
  const Place centre{static_cast<int>(line), static_cast<int>(std::lrint(rated.position(line)))};
  if (rated.frame.lit.depth() == CV_16U) {
    look_at_image<std::uint16_t>(rated, centre, patch);
  } else {
    look_at_image<std::uint8_t>(rated, centre, patch);
  }
  const float least_dn = kLeastHeight * static_cast<float>(rated.frame.full_scale_dn);
  scale(rated, centre, std::max(rated.stripe.amplitude_dn[line], least_dn), patch);
  draw_returns(rated, centre, patch);
}

}  // namespace striper::detail
