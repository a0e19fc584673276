// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stripe/candidates/peak_candidates.hpp"
#include "stripe/profile/profile_plan.hpp"
#include "stripe/select/stripe_pieces.hpp"

namespace striper::testing {

/// A peak of a frame that shows nothing but such.
struct Peak {
  int line;
  double across;         // Its error is kSigma.
  float height = 10.0F;  // And its significance.
};

/// The pieces of a frame whose scan lines have these peaks, in the order of scan lines.
class PeaksOfAFrame {
 public:
  static constexpr float kSigma = 0.1F;

  PeaksOfAFrame(int lines, const std::vector<Peak>& peaks) {
    for (int line = 0; line < lines; ++line) {
      candidates_.primary.seeds.push_back({line, 0});
    }
    for (const Peak& peak : peaks) candidates_.secondary.seeds.push_back({peak.line, 0});
    candidates_.primary.make_room(static_cast<std::size_t>(lines));
    candidates_.secondary.make_room(peaks.size());
    for (std::size_t i = 0; i < candidates_.primary.size(); ++i)
      set(candidates_.primary, i, 0.0, 0.0F);
    for (std::size_t i = 0; i < peaks.size(); ++i)
      set(candidates_.secondary, i, peaks[i].across, peaks[i].height);
    pieces_.find(candidates_, detail::WidthModel{.at_pivot = 1.0}, 5.0F);
    pieces_.measure_off_line();
  }

  const detail::StripePieces& pieces() const { return pieces_; }

 private:
  static void set(detail::PeakList& list, std::size_t i, double across, float significance) {
    list.across[i] = static_cast<std::int32_t>(across);
    list.offset[i] = static_cast<float>(across - list.across[i]);
    list.amplitude[i] = significance;
    list.width[i] = 1.0F;
    list.sigma[i] = kSigma;
    list.significance[i] = list.snr[i] = significance;
    list.clipped[i] = list.level[i] = list.slope[i] = 0.0F;
  }

  detail::PeakCandidates candidates_;
  detail::StripePieces pieces_;
};

}  // namespace striper::testing
