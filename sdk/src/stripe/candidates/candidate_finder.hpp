// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

#include <striper/stripe/extractor.hpp>

#include "stripe/candidates/block_maxima.hpp"
#include "stripe/candidates/detection.hpp"
#include "stripe/candidates/peak_candidates.hpp"
#include "stripe/candidates/peak_measurer.hpp"
#include "stripe/candidates/ridges/clipped_runs.hpp"
#include "stripe/candidates/ridges/ridges.hpp"
#include "stripe/candidates/ridges/ridges_at_edges.hpp"
#include "stripe/candidates/searched_part.hpp"
#include "stripe/profile/frame_at_hand.hpp"

namespace striper::detail {

/// From here on what a scan line shows is no noise.
inline constexpr float kClearSignificance = 8.0F;

/// Finds what in a frame may be the stripe, and measures it: of each scan line its brightest
/// pixels, and where the background hides the stripe all its ridges and what is clipped.
class CandidateFinder {
 public:
  /// @param options outlive it.
  explicit CandidateFinder(const ExtractOptions& options);
  CandidateFinder(const CandidateFinder&) = delete;
  CandidateFinder& operator=(const CandidateFinder&) = delete;

  /// Begins a frame: the brightest pixels of every scan line.
  void begin(const LitFrame& frame);

  /// Finds and measures the candidates, of a stripe so wide.
  void find(const FrameAtHand& at_hand, const SearchedPart& part, const WidthModel& width);

  /// The same among ridges, from now on and for this frame.
  void find_ridges(const FrameAtHand& at_hand, const SearchedPart& part, const WidthModel& width);

  /// Whether the background hides the stripe: candidates are ridges.
  bool is_hidden() const noexcept { return is_hidden_; }

  const BlockMaxima& blocks() const noexcept { return blocks_; }
  const Detection& detection() const noexcept { return detection_; }
  const PeakCandidates& candidates() const noexcept { return candidates_; }
  PeakCandidates& candidates() noexcept { return candidates_; }

 private:
  bool is_hidden_by_background(const FrameAtHand& at_hand) const;
  void take_ridges(const FrameAtHand& at_hand, const WidthModel& width);
  void drop_what_is_none(const SearchedPart& part);

  const ExtractOptions& options_;
  BlockMaxima blocks_;
  Detection detection_;
  PeakCandidates candidates_;
  PeakMeasurer measurer_;
  bool is_hidden_ = false;
  cv::Mat difference_;  // Lit minus dark, in which ridges are looked for.
  Ridges ridges_;
  ClippedRuns clipped_runs_;
  RidgesAtEdges ridges_at_edges_;
};

}  // namespace striper::detail
