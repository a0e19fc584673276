// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/core/lit_frame.hpp>
#include <striper/pipeline/expect_stripe.hpp>
#include <striper/simulator/truth.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/profile_extractor.hpp"
#include "support/choice_trial.hpp"

namespace striper::testing {

// A frame of a trial, as it was extracted.
struct Extracted {
  const detail::ProfileExtractor& extractor;
  const LitFrame& frame;
  const Stripe& stripe;
  const Truth& truth;
};

// Whatever it takes for a stripe is to have a position.
inline ExtractOptions with_all_positions(ExtractOptions options) {
  options.min_confidence = 0.0;
  return options;
}

struct TrialSearch {
  bool is_turned = false;            // Along the other axis, where there is no stripe.
  bool is_for_all_positions = true;  // Doubtful returns have one, too.
};

// Of what a trial's scanner looks at, what it sees before there are scans; `visit` gets each frame.
template <typename Visit>
void extract_trial(const ChoiceTrial& trial, const TrialSearch& search, const Visit& visit) {
  TrialCamera camera(trial);
  const ScannerOptions options = camera.options();
  ExtractOptions stripe_options =
      search.is_for_all_positions ? with_all_positions(options.stripe) : options.stripe;
  if (!search.is_turned && trial.knows_stripe) {
    stripe_options.expected = {expect_stripe(camera.model(), 0, options.scan)};
  }
  detail::ProfileExtractor extractor(stripe_options);
  AmbientStage stage(options.ambient);
  Stripe stripe;
  for (int i = 0; i < camera.frames(); ++i) {
    const auto number = static_cast<std::uint64_t>(i);
    stage.push(camera.render(number));
    const Truth truth = camera.truth(number);
    while (const LitFrame* lit = stage.next()) {
      LitFrame frame = *lit;
      if (search.is_turned) frame.lit = cv::Mat(lit->lit.t());
      extractor.extract(frame, stripe);
      visit(Extracted{extractor, frame, stripe, truth});
    }
  }
}

}  // namespace striper::testing
