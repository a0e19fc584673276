// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/stripe/extractor.hpp>

#include "stripe/candidates/candidate_finder.hpp"
#include "stripe/candidates/searched_part.hpp"
#include "stripe/learn/laser_widths.hpp"
#include "stripe/noise/extraction_noise.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/report/clipped_errors.hpp"
#include "stripe/report/error_budget.hpp"
#include "stripe/report/return_confidence.hpp"
#include "stripe/report/return_evidence.hpp"
#include "stripe/report/stripe_report.hpp"
#include "stripe/select/stripe_choice.hpp"
#include "stripe/track/bridged_gaps.hpp"

namespace striper::detail {

/// The methods `fast` and `refined`: candidates from one pass over the image, each measured with a
/// matched filter of the stripe's own width (and Gauss-Newton), the best one of each scan line
/// chosen on the filtered profile, its error from the Fisher information.
///
/// Learns from frame to frame, for each laser by itself: the stripe's width and its excess scatter;
/// and for the stream the noise.
class ProfileExtractor : public StripeExtractor {
 public:
  explicit ProfileExtractor(const ExtractOptions& options) : options_(options), finder_(options_) {}

  void extract(const LitFrame& frame, Stripe& stripe) override;
  LineExplanation explain(int line) const override;

  /// What was decided of the last frame, for whoever fits the weights of the evidence.
  const StripeChoice& choice() const noexcept { return choice_; }
  /// What was found of edges beside its returns, for whoever tests what is made of it.
  const ReflectanceEdges& edges() const noexcept { return errors_.edges(); }

  /// How probable its returns are, for whoever fits what looks at the image about them.
  const ReturnConfidence& confidence() const noexcept { return confidence_; }

  /// Whether the return of a scan line is none of the choice's: it was measured on the line of
  /// those about it.
  bool is_bridged(int line) const noexcept { return bridges_.has(line); }
  const BridgedGaps& bridges() const noexcept { return bridges_; }

  /// All that is known of the return of a scan line that was chosen, not bridged.
  Evidence evidence(const Stripe& stripe, int line) const noexcept;

  /// The first pixel across of the part of that frame that was searched.
  int searched_from_px() const noexcept { return part_.from_px(); }

 private:
  // Of the last frame, where it may have to be explained.
  struct Kept {
    LitFrame frame;
    PlanNoise noise;
    WidthModel width;
    Stripe stripe;
  };

  struct Frames {
    const LitFrame& whole;
    const LitFrame& searched;
  };

  void extract_searched(const Frames& frames, Stripe& stripe);
  FrameAtHand at_hand(const LitFrame& frame);
  void find_and_choose(const FrameAtHand& at_hand, WidthTracker& width);
  void try_widths(const FrameAtHand& at_hand, WidthTracker& width);
  void choose(const FrameAtHand& at_hand, const WidthTracker& width);
  ChoiceContext context_of(const FrameAtHand& at_hand, const WidthTracker& width) const;
  float threshold() const;
  bool is_more_than_peaks(const LitFrame& frame) const;
  void rate_returns(const StripeReport::Choice& chosen, const LitFrame& whole, Stripe& stripe);
  bool is_look_known(int laser) const;
  void bridge_gaps(const FrameAtHand& at_hand, const WidthModel& width, Stripe& stripe);

  void keep_for_explanation(const LitFrame& frame, const PlanNoise& noise, const WidthModel& width,
                            const Stripe& stripe);
  void explain_candidates(const AxisGrid& across, LineExplanation& why) const;
  void explain_sigma(const AxisGrid& across, LineExplanation& why) const;

  ExtractOptions options_;
  SearchedPart part_;
  ExtractionNoise noise_;
  CandidateFinder finder_;
  LaserWidths widths_;
  StripeChoice choice_;
  StripeReport report_;
  ErrorBudget errors_;
  ReturnEvidence evidence_;
  ClippedErrors clipped_errors_;
  ReturnConfidence confidence_;
  BridgedGaps bridges_;
  Kept kept_;
};

}  // namespace striper::detail
