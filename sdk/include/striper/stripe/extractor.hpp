// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include <striper/core/lit_frame.hpp>
#include <striper/core/noise_model.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/stripe/stripe.hpp>

namespace striper {

/// How the stripe is found in a line of pixels.
enum class ExtractMethod {
  kPaper,  ///< Brightest pixel above a threshold, then its centroid with its two neighbours. Mertz
           ///< et al. 2002.
  kFast,   ///< Matched filter, local linear background, log-parabola.
  kRefined,  ///< kFast, then Gauss-Newton with variance weights, clipped pixels masked.
};

/// What `make_extractor` needs to know. Every default is here and nowhere else.
struct ExtractOptions {
  ExtractMethod method = ExtractMethod::kPaper;
  StripeAxis axis = StripeAxis::kColumns;

  /// A peak must rise this far above the background, DN of the input. Empty: from the noise of the
  /// frame.
  std::optional<double> threshold_dn;

  /// The camera's noise; empty: estimated from each frame's background.
  std::optional<NoiseModel> noise;

  /// @throws Error{kBadValue} naming the field and its bound.
  void validate() const;
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
};

/// @throws Error{kBadValue} where the options are not valid.
std::unique_ptr<StripeExtractor> make_extractor(const ExtractOptions& options);

}  // namespace striper
