// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/stripe/stripe.hpp>

#include "stripe/report/return_confidence.hpp"
#include "stripe/report/return_evidence.hpp"
#include "stripe/select/forests/choice_trees.hpp"

namespace striper::detail {

/// Widens the errors of clipped returns that are doubted. Their flanks and the ends of what is
/// clipped tell where they are, which edges and textures hide or move on one side or the other, and
/// a fit of what is left may be sure of the wrong place: what ReturnConfidence doubts of them is
/// mostly that, not that they are the stripe. Scenes with truth tell by how much more they are off
/// than was reckoned. What is sure keeps its error: it is what was reckoned. (StripeChoice has the
/// errors of what is not clipped, sure or not.)
///
/// No state but its memory, and no allocation.
class ClippedErrors {
 public:
  /// Never narrows one. @param alone as it rated the returns, each by itself.
  void widen(const ReturnEvidence& evidence, const ReturnEvidence::Measured& measured,
             const ReturnConfidence& alone, Stripe& stripe);

  /// What evidence of such a return says that its sigma is to be multiplied with: 1 or more. (What
  /// is widened stays within sigma_limit_px.)
  static float factor(const Evidence& evidence) noexcept;

 private:
  void finish_batch(const StripeChoice& choice, Stripe& stripe);

  EvidenceBatch batch_;
};

}  // namespace striper::detail
