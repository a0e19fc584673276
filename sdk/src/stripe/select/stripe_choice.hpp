// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stripe/select/evidence/evidence.hpp"
#include "stripe/select/evidence/frame_evidence.hpp"
#include "stripe/select/forests/choice_trees.hpp"
#include "stripe/select/piece_scatter.hpp"
#include "stripe/select/piece_traits.hpp"
#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// Decides over the whole image which candidate of each scan line is the stripe, and how probable
/// that is: the candidates' pieces against the background's, the frame's main pieces against no
/// laser at all.
///
/// A plain frame 20 ns a candidate. Another one 50 ns for each that is hopeless, and 2 to 10 us for
/// each that is not, by how many there are. No allocation after the first frame of a size.
class StripeChoice {
 public:
  /// Log odds; what was chosen and is less probable has no error that is looked at.
  static constexpr float kHopelessChosen = -2.0F;

  struct Chosen {
    std::int32_t candidate = -1;  // Of `pieces()`; -1: the scan line has none.
    float confidence = 0.0F;      // That it is the stripe, as far as candidates tell.
    float rival = 0.0F;           // Confidence of the scan line's next best.
    std::int32_t rival_candidate = -1;
    float sigma_factor = 1.0F;  // Its sigma over the reckoned one, by such evidence: a third of
                                // what nearly all errors are within.
  };

  /// Chooses among the candidates of a frame. @param threshold of significance.
  void choose(const PeakCandidates& candidates, const ChoiceContext& context, float threshold);

  /// Finds the pieces alone, for `merit` and `width`: nothing is chosen.
  void survey(const PeakCandidates& candidates, const ChoiceContext& context, float threshold);

  /// Whether the frame is so plain that each scan line can tell by itself: its background is
  /// subtracted, or nearly every scan line shows something, and the highest things go on from scan
  /// line to scan line (in all but 1.5 % of them over 16 and more), or hardly any shows more than
  /// noise may. Then nothing is chosen here: a scan line's highest peak is the stripe, with the
  /// probability that it is no noise.
  bool is_plain() const noexcept { return is_plain_; }

  /// Whether what a plain frame shows hardly anywhere goes on from scan line to scan line: what is
  /// left of the background's edges. Never where a dark exposure is subtracted, or scan lines tell
  /// by themselves.
  bool is_scattered() const noexcept { return is_scattered_; }

  const StripePieces& pieces() const noexcept { return pieces_; }
  const Chosen& of_line(int line) const noexcept { return chosen_[static_cast<std::size_t>(line)]; }

  /// The log odds of each candidate, rivals in its scan line left out.
  float log_odds(std::size_t candidate) const noexcept { return log_odds_[candidate]; }

  /// By how much a candidate's position is off beyond its own sigma, see PieceScatter. 0 in a plain
  /// frame.
  float scatter_px(std::size_t candidate) const noexcept { return scatter_.px()[candidate]; }

  /// The expected width as it was used: the context's, or that of the main pieces.
  const WidthModel& width() const noexcept { return traits_.width(); }
  /// Of the frame, see PieceTraits.
  float coverage() const noexcept { return traits_.coverage(); }
  float clutter() const noexcept { return traits_.clutter(); }

  /// How many scan lines the main pieces cover, each as far as it is like a stripe and alone. 5 us.
  float merit() const noexcept;

  /// For whoever weighs once more, or fits the trees; of a frame that is not plain. What came of
  /// weighing is the latest frame's, as each forest weighed it.
  Evidence evidence(std::size_t candidate) const noexcept {
    return evidence_.for_third(looked_at(), candidate);
  }

 private:
  FrameEvidence::Frame looked_at() const noexcept {
    return {pieces_, traits_, context_, scatter_.px()};
  }
  void reserve();
  void weigh_first();
  void weigh_again();
  void weigh_last();
  void add_to_batch(const ChoiceForest& forest, std::size_t candidate, const Evidence& evidence,
                    std::vector<float>& odds);
  void finish_batch(const ChoiceForest& forest, std::vector<float>& odds);
  bool is_orderly() const noexcept;
  bool has_short_things() const noexcept;
  std::int32_t highest_of(int line) const noexcept;
  void choose_in_lines();
  void widen_chosen();
  void widen_batch();
  void choose_highest();

  StripePieces pieces_;
  PieceTraits traits_;
  ChoiceContext context_;
  bool is_plain_ = false;
  bool is_scattered_ = false;
  PieceScatter scatter_;
  FrameEvidence evidence_;
  std::vector<float> log_odds_;
  EvidenceBatch batch_;
  std::vector<Chosen> chosen_;
};

}  // namespace striper::detail
