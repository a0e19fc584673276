// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <striper/stripe/candidates.hpp>
#include <striper/stripe/extractor.hpp>

#include "stripe/background_noise.hpp"
#include "stripe/continuous_tracker.hpp"
#include "stripe/detection.hpp"
#include "stripe/excess_scatter.hpp"
#include "stripe/profile_kernel.hpp"
#include "stripe/profile_plan.hpp"
#include "stripe/width_tracker.hpp"

namespace striper::detail {

/// The methods `fast` and `refined`: candidates from one pass over the image, each measured with a
/// matched filter of the stripe's own width (and Gauss-Newton), the best one of each line chosen on
/// the filtered profile, its error from the Fisher information.
///
/// Learns from frame to frame, for each laser by itself: the stripe's width and its excess scatter;
/// and for the stream the noise.
class ProfileExtractor : public StripeExtractor {
 public:
  explicit ProfileExtractor(const ExtractOptions& options);

  void extract(const LitFrame& frame, Stripe& stripe) override;

 private:
  // What belongs to one laser's stripe.
  struct Learnt {
    WidthTracker width;
    ExcessScatter excess;
  };

  // A measured peak that may be the stripe.
  struct Peak {
    std::size_t seed;
    double position;  // Image pixels across.
    ReturnStatus status;
  };
  using LinePeaks = std::array<Peak, ChunkMaxima::kBest>;

  // The options as the inner loop compares them.
  struct Limits {
    float significance;
    float weak_significance;
    float amplitude;
    float snr;
    float narrow;
    float wide;
    float saturated_sigma;
  };

  // The measurements of all seeds, as the kernel writes them.
  struct Measured {
    void resize(std::size_t count);
    PeakMeasurements arrays();

    std::vector<std::int32_t> across;
    std::vector<float> offset, amplitude, width, sigma, significance, snr, clipped;
  };

  void set_limits();
  Learnt& learnt_of(int laser);
  PlanNoise noise_of(const LitFrame& frame);
  double noise_dn(const PlanNoise& noise) const;
  bool guess_width(const LitFrame& frame, double noise_dn, WidthTracker& width) const;
  void choose_seeds(double noise_dn);
  void align_seeds(int most);
  void measure(const LitFrame& frame, const PlanNoise& noise, const WidthTracker& width);
  void measure_weak_again(const ProfileImages& images, const PlanNoise& noise,
                          const WidthTracker& width, int border);
  double learn_width(const LitFrame& frame, WidthTracker& width);
  int add_clipped_samples(const LitFrame& frame, WidthTracker& width);
  int add_width_samples(double least_snr, WidthTracker& width) const;
  ReturnStatus judge(std::size_t seed, const WidthTracker& width) const;
  int peaks_of_line(int line, const WidthTracker& width, LinePeaks& out) const;
  bool is_preferred(const Peak& peak, const Peak& to) const;
  void report(const WidthTracker& width, Stripe& stripe) const;
  void report_line(int line, const LinePeaks& peaks, int count, Stripe& stripe) const;
  void put(std::size_t i, const Peak& peak, float share, ReturnStatus status, Stripe& stripe) const;
  void follow(const LitFrame& frame, const PlanNoise& noise, const WidthTracker& width,
              Stripe& stripe);
  bool take_candidate_at(int line, const WidthTracker& width, Stripe& stripe) const;
  void add_other_errors(const ExcessScatter& excess, Stripe& stripe) const;

  ExtractOptions options_;
  ChunkMaxima chunks_;
  BackgroundNoise background_noise_;
  Detection detection_;
  ContinuousTracker tracker_;
  std::vector<Learnt> learnt_;  // One per laser.

  std::vector<PeakSeed> seeds_;
  std::vector<std::int32_t> first_seed_;  // Of each line, and one more.
  Measured measured_;
  std::vector<PeakSeed> weak_seeds_;
  std::vector<std::int32_t> weak_index_;
  Measured weak_measured_;
  int next_clipped_line_ = 0;
  Limits limits_{};
  int length_ = 0;     // Pixels across the stripe of the frame at hand.
  double step_ = 1.0;  // Sensor pixels per image pixel across.
};

}  // namespace striper::detail
