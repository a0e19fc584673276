// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// What is known of the frame before its pieces are looked at.
struct ChoiceContext {
  WidthModel width;  // Expected, effective sigma, pixels of the image.
  bool is_width_known =
      false;                   // Given, or learnt from frames before; else from the frame's pieces.
  bool is_by_itself = false;   // Each line is to tell by itself.
  bool is_hidden = false;      // The background is such that candidates are ridges.
  bool is_subtracted = false;  // An exposure without the laser has taken the background away.
};

/// What is seen of a candidate, its piece and its frame, that tells the stripe from the background;
/// each number is about 0 to 1. The confidence is a logistic function of their weighted sum.
struct Evidence {
  enum Kind : std::size_t {
    kOne,
    kLength,       // log2 of the piece's lines,
    kIsShort,      // and 1 over them,
    kSupport,      // and log2 of those of all pieces that it is joined with.
    kRoughness,    // Its bends over what noise makes of them, log2,
    kBends,        // and in pixels.
    kWide,         // Mean width over the expected one, less 1,
    kNarrow,       // and the other way round.
    kWidthSpread,  // About its own mean.
    kFaint,        // log2 of the main pieces' height over its own,
    kBright,       // and the other way round.
    kHeightChange,
    kTilt,      // Of the background, in heights over a width: an edge.
    kSnr,       // log2.
    kClipped,   // Share of clipped peaks.
    kCoverage,  // Part of the scan lines that the main pieces cover,
    kClutter,   // and log2 of 1 + how many other candidates as strong there are a line.
    kSubtracted,
    kHidden,          // By its background: candidates are ridges.
    kHiddenSupport,   // kHidden x kSupport.
    kClutterSupport,  // kClutter x kSupport.
    kWideKnown,       // kWide and kNarrow, where the expected width was known before.
    kNarrowKnown,
    kCoverageShort,  // kCoverage x kIsShort.
    kClutterShort,   // kClutter x kIsShort.
    kOwnWidth,       // The candidate's own difference from its piece's width,
    kOwnBend,        // and bend,
    kOwnEnd,         // and 1 over its distance from the piece's end,
    kOwnOffNear,     // and how far it lies off those beside it, pixels.
    kOwnOffFar,
    kClippedBright,  // kClipped x kBright: a light source.
    kCount
  };
  std::array<float, kCount> of{};
};

/// Decides over the whole image which candidate of each line is the stripe, and how probable that
/// is: the candidates' pieces against the background's, the frame's main pieces against no laser at
/// all.
///
/// 20 ns a candidate. No allocation after the first frame of a size.
class StripeChoice {
 public:
  struct Chosen {
    std::int32_t candidate = -1;  // Of `pieces()`; -1: the line has none.
    float confidence = 0.0F;      // That it is the stripe.
    float rival = 0.0F;           // Confidence of the line's next best.
    std::int32_t rival_candidate = -1;
  };

  /// Chooses among the candidates of a frame. @param threshold of significance.
  void choose(const PeakCandidates& candidates, const ChoiceContext& context, float threshold);

  /// Whether the frame is so plain that each line can tell by itself: its background is subtracted,
  /// or nearly every line shows something and the highest things go on from line to line, or hardly
  /// any shows more than noise may. Then nothing is chosen here: a line's highest peak is the
  /// stripe, with the probability that it is no noise.
  bool is_plain() const noexcept { return is_plain_; }

  const StripePieces& pieces() const noexcept { return pieces_; }
  const Chosen& of_line(int line) const noexcept { return chosen_[static_cast<std::size_t>(line)]; }

  /// The log odds of each candidate, rivals in its line left out.
  float log_odds(std::size_t candidate) const noexcept { return log_odds_[candidate]; }

  /// By how much a candidate's position is off beyond its own sigma, as it lies beside its piece:
  /// pixels, one sigma. What the texture of a surface does to a stripe, and the curve of one. 0 in
  /// a plain frame.
  float scatter_px(std::size_t candidate) const noexcept { return scatter_px_[candidate]; }

  /// The expected width as it was used: the context's, or that of the main pieces.
  const WidthModel& width() const noexcept { return width_; }

  /// How many lines the main pieces cover, each as far as it is like a stripe and alone. 5 us.
  float merit() const noexcept;

  /// For whoever fits the weights.
  Evidence evidence(std::size_t candidate) const noexcept;

 private:
  // Of one piece. Sums become means.
  struct Trait {
    float bends = 0.0F, roughness = 0.0F, width = 0.0F, width_spread = 0.0F, height = 0.0F,
          height_change = 0.0F, tilt = 0.0F, snr = 0.0F, clipped = 0.0F;
    float seen_widths = 0.0F;  // How many of its candidates tell their width.
    float first_guess = 0.0F;
    float log_odds = 0.0F;
  };
  void sum_up(const ChoiceContext& context);
  void find_main_pieces(const ChoiceContext& context);
  void guess_pieces(bool use_width);
  void measure_frame();
  void weigh();
  Evidence evidence_of_piece(std::size_t piece) const noexcept;
  void add_own(std::size_t candidate, Evidence& evidence) const noexcept;
  bool is_orderly() const noexcept;
  void choose_in_lines();
  void choose_highest();
  void measure_scatter();

  StripePieces pieces_;
  WidthModel width_;
  ChoiceContext context_;
  bool is_plain_ = false;
  float width_scale_ = 1.0F;
  float main_height_ = 0.0F;  // log2 DN.
  float coverage_ = 0.0F;
  float clutter_ = 0.0F;
  std::vector<Trait> traits_;
  std::vector<float> log_odds_;
  std::vector<float> scatter_px_, backward_;
  std::vector<Chosen> chosen_;
};

}  // namespace striper::detail
