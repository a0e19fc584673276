// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <striper/stripe/candidates.hpp>
#include <striper/stripe/extractor.hpp>

#include "stripe/candidates/detection.hpp"
#include "stripe/candidates/peak_candidates.hpp"
#include "stripe/edges/background_edge.hpp"
#include "stripe/edges/reflectance_edge.hpp"
#include "stripe/learn/excess_scatter.hpp"
#include "stripe/learn/texture_scatter.hpp"
#include "stripe/learn/width_learner.hpp"
#include "stripe/noise/background_noise.hpp"
#include "stripe/profile/profile_kernel.hpp"
#include "stripe/profile/profile_plan.hpp"
#include "stripe/select/ridges.hpp"
#include "stripe/select/stripe_choice.hpp"
#include "stripe/track/line_follower.hpp"

namespace striper::detail {

/// The methods `fast` and `refined`: candidates from one pass over the image, each measured with a
/// matched filter of the stripe's own width (and Gauss-Newton), the best one of each line chosen on
/// the filtered profile, its error from the Fisher information.
///
/// Learns from frame to frame, for each laser by itself: the stripe's width and its excess scatter;
/// and for the stream the noise.
class ProfileExtractor : public StripeExtractor {
 public:
  explicit ProfileExtractor(const ExtractOptions& options) : options_(options) {}

  void extract(const LitFrame& frame, Stripe& stripe) override;
  LineExplanation explain(int line) const override;

  /// What was decided of the last frame, for whoever fits the weights of the evidence.
  const StripeChoice& choice() const noexcept { return choice_; }

  /// The first pixel across of the part of that frame that was searched.
  int searched_from_px() const noexcept { return searched_from_px_; }

 private:
  // What belongs to one laser's stripe.
  struct Learnt {
    WidthTracker width;
    ExcessScatter excess;
  };

  // The first and last pixel across between which the stripe of each line can be; empty: anywhere.
  struct Limits {
    std::vector<float> first, last;
  };

  // The frame at hand.
  struct Current {
    const LitFrame& frame;
    ProfileImages images;
    PlanNoise noise;
    double noise_dn;  // Of a dark pixel.
    double step;      // Sensor pixels per image pixel across.
  };

  // Of the last frame, where it may have to be explained.
  struct Kept {
    LitFrame frame;
    PlanNoise noise;
    WidthModel width;
    Stripe stripe;
  };
  void keep_for_explanation(const LitFrame& frame, const PlanNoise& noise, const WidthModel& width,
                            const Stripe& stripe);
  void explain_candidates(const AxisGrid& across, LineExplanation& why) const;
  void explain_sigma(const AxisGrid& across, LineExplanation& why) const;

  const ExpectedStripe* expected_of(int laser) const;
  LitFrame searched_part(const LitFrame& frame, const ExpectedStripe* expected);
  void extract_searched(const LitFrame& frame, Stripe& stripe);
  Learnt& learnt_of(int laser);
  PlanNoise noise_of(const LitFrame& frame, const ProfileImages& images);
  void take_given_noise(const LitFrame& frame, const ProfileImages& images, double exposures);
  std::optional<WidthModel> known_width(const LitFrame& frame) const;
  void begin_width(const Current& current, WidthTracker& width) const;
  void choose(const Current& current, const WidthTracker& width);
  void try_widths(const Current& current, WidthTracker& width);
  void measure(const Current& current, const WidthModel& width);
  bool is_by_itself() const noexcept;
  bool is_hidden_by_background(const LitFrame& frame) const;
  bool is_more_than_peaks(const LitFrame& frame) const;
  void choose_among_ridges(const Current& current, const WidthTracker& width);
  void look_for_ridges(const Current& current, const WidthModel& width);
  void measure(const Current& current, const WidthModel& width, const ProfilePlan& plan,
               PeakList& peaks);
  void measure_weak_again(const Current& current, const WidthModel& width, int border,
                          PeakList& peaks);
  void refuse_outside(PeakList& peaks) const;
  void refuse_edges(const Current& current, const WidthModel& width, const ProfilePlan& plan,
                    PeakList& peaks);
  void refuse_edge(const Current& current, const WidthModel& width, std::size_t i, PeakList& peaks);
  bool is_beside_first(const PeakPlace& place) const;
  void measure_and_learn(const Current& current, WidthTracker& width);
  void report(const Current& current, const WidthModel& width, Stripe& stripe);
  void mark_alone(Stripe& stripe) const;
  void mark_outliers(Stripe& stripe) const;
  void mark_blind_lines(const LitFrame& frame, Stripe& stripe) const;
  void widen_by_evidence(Stripe& stripe) const;
  void add_other_errors(const ExcessScatter& excess, double step, Stripe& stripe) const;

  ExtractOptions options_;
  ChunkMaxima chunks_;
  BackgroundNoise background_noise_;
  NoiseModel given_noise_;  // In the DN of pictures of this full scale.
  int noise_full_scale_dn_ = 0;
  Detection detection_;
  PeakCandidates candidates_;
  PeakList weak_;
  std::vector<std::size_t> weak_index_;
  bool is_hidden_ = false;  // The stripe, by the background: candidates are ridges.
  cv::Mat difference_;      // Lit minus dark, in which ridges are looked for.
  Ridges ridges_;
  Limits limits_;
  int searched_from_px_ = 0;
  StripeChoice choice_;
  WidthLearner width_learner_;
  LineFollower follower_;
  ReflectanceEdges edges_;
  TextureScatter texture_;
  std::vector<Learnt> learnt_;  // One per laser.
  Kept kept_;
};

/// The pixels of a frame, as the kernel reads them.
ProfileImages images_of(const LitFrame& frame, StripeAxis axis);

}  // namespace striper::detail
