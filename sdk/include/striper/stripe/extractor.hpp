// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <striper/ambient/asked.hpp>
#include <striper/core/event.hpp>
#include <striper/core/lit_frame.hpp>
#include <striper/core/noise_model.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/stripe/expected_stripe.hpp>
#include <striper/stripe/line_explanation.hpp>
#include <striper/stripe/stripe.hpp>

namespace striper {

/// How the stripe is found in a scan line.
enum class ExtractMethod {
  kPaper,  ///< Brightest pixel above a threshold, then its centroid with its two neighbours. Mertz
           ///< et al. 2002.
  kFast,   ///< Matched filter, local linear background, log-parabola.
  kRefined,  ///< kFast, then Gauss-Newton with variance weights, clipped pixels masked; the middle
             ///< of what is clipped counts as a measurement of its own.
};

/// Which of the peaks of a scan line is the stripe.
enum class PeakRule {
  kBrightest,   ///< The one that rises highest; a rival about as high makes it kAmbiguous.
  kNearest,     ///< The one nearest to the sensor: behind glass, rain, leaves is not what counts.
  kFarthest,    ///< The one farthest from it: through glass, rain, leaves.
  kContinuous,  ///< As kBrightest, and where a scan line alone cannot tell the one that continues
                ///< its neighbours.
  kAll,         ///< Every one, in order across the stripe: a Stripe may then be of any size.
};

/// Which end of a scan line is near: the model knows (`Scanner` fills it in).
enum class NearEnd { kFirstPixel, kLastPixel };

/// What `make_extractor` needs to know. Every default is here and nowhere else.
struct ExtractOptions {
  ExtractMethod method = ExtractMethod::kRefined;
  Asked<StripeAxis> axis = Asked<StripeAxis>::otherwise(StripeAxis::kColumns);

  /// A peak must rise this far above the background, DN of the input. Empty: from the noise of the
  /// frame.
  std::optional<double> threshold_dn;

  /// The camera's noise; empty: estimated from each frame's background, without shot noise. A
  /// Scanner takes the model's first.
  std::optional<NoiseModel> noise;

  // What follows is for `fast` and `refined`.

  /// docs/peaks.md has a table of the rules over all scenes and real images: kContinuous finds
  /// more, and more that is not the stripe where all of it is dim. It costs nothing where nothing
  /// is subtracted from the image, nor of scan lines with one strong peak alone.
  PeakRule peak = PeakRule::kBrightest;
  /// For kNearest and kFarthest.
  Asked<NearEnd> near_end = Asked<NearEnd>::otherwise(NearEnd::kLastPixel);

  /// How often noise alone may make a return in a scan line without stripe: below, kNoStripe.
  double false_alarm_rate = 1e-3;
  /// And how often one that is not reported as kWeak.
  double weak_false_alarm_rate = 1e-5;
  /// Peaks below this signal-to-noise ratio (amplitude over the noise of the peak pixel) are kWeak.
  double min_snr = 0.0;

  /// Peaks narrower or wider than these multiples of the frame's stripe are kNarrow, kWide.
  double min_width_ratio = 0.6;
  double max_width_ratio = 1.7;
  /// The stripe's Gaussian sigma in pixels of the image; empty: measured, and tracked.
  std::optional<double> stripe_sigma_px;

  /// Where each laser's stripe can be and how wide it is, element i that of laser i; `Scanner`
  /// takes it from the model where it is empty. `stripe_sigma_px` goes before its widths.
  std::vector<ExpectedStripe> expected;

  /// A second peak at least this fraction as high as the brightest one makes a return kAmbiguous.
  double ambiguity_ratio = 0.8;
  /// Returns of clipped stripes whose error is larger than this, pixels of the image, are
  /// kSaturated.
  double max_saturated_sigma_px = 0.5;

  /// Contrast per pixel of noise proportional to the signal (speckle): it weights the fit.
  double speckle_contrast = 0.0;
  /// Every scan line tells by itself which of its peaks is the stripe, whatever the rest of the
  /// image shows: for who looks where nothing else is, or chooses along the stripe himself.
  bool each_line_by_itself = false;

  /// Returns that are the stripe with a smaller probability than this are kOutlier.
  double min_confidence = 0.99;

  /// An error that every return has besides the noise of its pixels (speckle, rough surfaces),
  /// pixels of the image; empty: measured from the scatter of the stripe along itself.
  std::optional<double> excess_sigma_px;

  /// @throws Error{kBadValue} naming the field and its bound.
  void validate() const;

  EventPort events;  ///< Hears what is wrong with what was given.

  /// Keeps what `StripeExtractor::explain` needs: a copy of the last frame.
  bool can_explain = false;
};

/// Finds the stripe in lit frames. Holds its buffers and what it learnt from earlier frames, so one
/// extractor serves one stream: not thread-safe, one thread at a time.
class StripeExtractor {
 public:
  StripeExtractor() = default;
  StripeExtractor(const StripeExtractor&) = delete;
  StripeExtractor& operator=(const StripeExtractor&) = delete;
  virtual ~StripeExtractor() = default;

  /// Fills `stripe` with one element per column or row of `frame.lit`. No allocation after the
  /// first frame of a size.
  virtual void extract(const LitFrame& frame, Stripe& stripe) = 0;

  /// Why a scan line of the last frame gave the return that it gave. For people: 5 us, allocates.
  /// @throws Error{kUnsupported} for method `paper`, Error{kBadValue} where `can_explain` was not
  ///         asked for or there is no such scan line.
  virtual LineExplanation explain(int line) const;
};

/// @throws Error{kBadValue} where the options are not valid.
std::unique_ptr<StripeExtractor> make_extractor(const ExtractOptions& options);

}  // namespace striper
