// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/stripe/expected_stripe.hpp>

#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// What is known of the frame before its pieces are looked at.
struct ChoiceContext {
  WidthModel width;  // Expected, effective sigma, pixels of the image.
  bool is_width_known =
      false;                   // Given, or learnt from frames before; else from the frame's pieces.
  bool is_by_itself = false;   // Each scan line is to tell by itself.
  bool is_hidden = false;      // The background is such that candidates are ridges.
  bool is_subtracted = false;  // The background: an exposure without the laser.
  float black_dn = 0.0F;
  const LitFrame* frame = nullptr;  // Null: profiles are not looked at.
  StripeAxis axis = StripeAxis::kColumns;
  const ExpectedStripe* expected = nullptr;
};

/// Sums up each piece of a frame: how smooth, wide, high it is. Logarithms are to base 2, good to
/// 0.01. 20 ns a candidate. No allocation after the first frame of a size.
class PieceTraits {
 public:
  /// Of a width in expected ones, and of a way in pixels: less is taken for so much, since its
  /// logarithm has no end.
  static constexpr float kLeastWidth = 0.05F;

  // Of one piece. Sums become means.
  struct Trait {
    float bends = 0.0F, roughness = 0.0F, width = 0.0F, width_spread = 0.0F, height = 0.0F,
          height_change = 0.0F, tilt = 0.0F, snr = 0.0F, clipped = 0.0F, misfit = 0.0F;
    float height_spread = 0.0F, light = 0.0F, light_spread = 0.0F, level = 0.0F, levels = 0.0F,
          follows = 0.0F, gain = 0.0F, texture = 0.0F;
    float seen_widths = 0.0F;  // How many of its candidates tell their width.
    float first_guess = 0.0F;
  };

  /// What is seen of a candidate beyond its measurement.
  struct Look {
    float height = 0.0F;  // Log of its amplitude,
    float light = 0.0F;   // of that over the background,
    float gain = 0.0F;    // over that on white paper at its range; kUnknown.
    float misfit = 0.0F;
    float sides = 0.0F;
    float texture = 0.0F;  // Log of its height over the texture beside it.
  };

  void reserve(std::size_t most);

  /// Sums up all pieces of a frame and finds those that are about as the stripe is.
  void sum_up(const StripePieces& pieces, const ChoiceContext& context);

  /// Looks at the profiles' pixels too, and at what is expected of them.
  void look_closer(const StripePieces& pieces, const ChoiceContext& context);

  const Trait& of_piece(std::size_t piece) const noexcept { return traits_[piece]; }
  const Look& of_candidate(std::size_t candidate) const noexcept { return looks_[candidate]; }

  /// The expected width as it was used: the context's, or that of the main pieces.
  const WidthModel& width() const noexcept { return width_; }
  /// A candidate's width in expected ones, at least kLeastWidth.
  float width_of(const Candidate& c) const noexcept {
    return std::max(c.width / expected_at(c), kLeastWidth);
  }
  float expected_at(const Candidate& c) const noexcept {
    return static_cast<float>(width_.at(static_cast<double>(c.across)));
  }
  /// What the context's width is to be multiplied with.
  float width_scale() const noexcept { return width_scale_; }

  // Of the main pieces, logs:
  float main_height() const noexcept { return main_height_; }
  float main_light() const noexcept { return main_light_; }
  float main_gain() const noexcept { return main_gain_; }
  /// Spread of the background's brightness along them, log.
  float main_level_spread() const noexcept { return main_level_spread_; }
  float coverage() const noexcept { return coverage_; }
  float clutter() const noexcept { return clutter_; }

  /// How likely a piece is a stripe, whatever the frame: 0 to 1.
  float likeness(std::size_t piece) const noexcept;

 private:
  void add_candidates(const StripePieces& pieces, const ChoiceContext& context);
  void finish(const StripePieces& pieces);
  void guess_pieces(const StripePieces& pieces, bool use_width);
  void find_main_pieces(const StripePieces& pieces, const ChoiceContext& context);
  void measure_frame(const StripePieces& pieces);

  std::vector<Trait> traits_;
  std::vector<Look> looks_;
  WidthModel width_;
  float width_scale_ = 1.0F;
  float main_height_ = 0.0F;
  float main_light_ = 0.0F;
  float main_gain_ = 0.0F;
  float main_level_spread_ = 0.0F;
  float coverage_ = 0.0F;
  float clutter_ = 0.0F;
};

/// The logarithm to base 2, to 0.01.
inline float fast_log2(float x) noexcept {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  const auto exponent = static_cast<float>(static_cast<int>(bits >> 23U) - 127);
  const auto mantissa = std::bit_cast<float>((bits & 0x7FFFFFU) | 0x3F800000U);
  return exponent + (-0.33582878F * mantissa + 2.0F) * mantissa - 1.65871022F;
}
/// 1 / (1 + exp(-x)).
float logistic(float x) noexcept;

}  // namespace striper::detail
