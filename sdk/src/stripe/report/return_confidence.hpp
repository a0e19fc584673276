// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/report/rated_neighbours.hpp"
#include "stripe/report/return_evidence.hpp"
#include "stripe/select/forests/choice_trees.hpp"

namespace striper::detail {

/// How probable each return is right, as it is reported: within half a pixel or three of its
/// sigmas (of the real images that the first rating learnt from, within what their references
/// tell). What was chosen tells most of it; that it was measured, corrected beside an edge and
/// given its error, more; once all were rated so, those about it: a return is surer between sure
/// ones, on a line with them; and where it is known what the stripe looks like, what the image
/// shows about those that are still doubted tells the rest.
///
/// For frames whose returns were chosen over the whole image, one a scan line. Costs the
/// trees of two forests a return, and 30 us a patch of the image about what is doubted: one in five
/// such scan lines, where their returns lie on a line (4 ms where all of 640 are doubted), at most
/// one a scan line. No allocation after the first frame of a size.
class ReturnConfidence {
 public:
  using Measured = ReturnEvidence::Measured;

  /// Of a frame of so many scan lines, none of which is rated yet.
  void begin(std::size_t lines);

  /// Rates all its returns, each by itself.
  void rate_alone(const ReturnEvidence& evidence, const Measured& measured, const Stripe& stripe);

  /// Rates them once more, by what that said of those about each. The stripe's sigmas may have
  /// grown since.
  void rate_among_others(const ReturnEvidence& evidence, const Measured& measured,
                         const Stripe& stripe);

  /// Rates those that are doubted by what a frame shows about them, where enough others are sure:
  /// that there is a stripe at all is not found from it. @param frame the whole of it.
  void rate_by_image(const ReturnEvidence& evidence, const Measured& measured,
                     const LitFrame& frame, const Stripe& stripe);

  /// The probability of a scan line's return; empty where it was not rated.
  std::optional<float> of_line(std::size_t line) const noexcept;

  /// What those about the returns told of them,
  const RatedNeighbours& neighbours() const noexcept { return neighbours_; }
  /// and the log odds of each scan line's return by that, before `rate_by_image`; kNoReturn where
  /// that was not called.
  const std::vector<float>& among_others() const noexcept { return among_others_; }

 private:
  // What a forest says of each return by its evidence.
  template <typename EvidenceOf>
  void weigh_returns(const ChoiceForest& forest, const std::vector<std::size_t>& returns,
                     EvidenceOf evidence_of);

  std::vector<float> odds_;          // Log odds of each scan line's return, as it was rated last,
  std::vector<float> among_others_;  // and before the image about it was looked at.
  RatedNeighbours neighbours_;
  EvidenceBatch batch_;
};

}  // namespace striper::detail
