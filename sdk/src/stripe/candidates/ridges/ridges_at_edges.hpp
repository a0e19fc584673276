// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/candidates/peak_list.hpp"
#include "stripe/profile/frame_at_hand.hpp"
#include "stripe/profile/profile_kernel.hpp"

namespace striper::detail {

/// Measures ridges again that are close to a brighter surface, such as a stripe on the black square
/// of a board a few pixels from a white one: a straight background through both surfaces passes
/// above it.
///
/// The surface that the ridge stands on is continued beyond the edge, and the profile kernel
/// measures the ridge on that. What is continued is known from the few pixels between ridge and
/// edge, whose noise the kernel takes for that of more. Frames with a variance of their own are
/// left as they are.
///
/// A copy of its window and one measuring more for each ridge that is measured again, a comparison
/// for any other. No allocation once there was room.
class RidgesAtEdges {
 public:
  /// Of a frame.
  struct Measured {
    const FrameAtHand& at_hand;
    const ProfilePlan& plan;
    int distance_px;  ///< At which a ridge rises above both of its sides.
  };

  /// Makes room for frames of this size and kind.
  void reserve(const LitFrame& frame, StripeAxis axis);

  /// @param rises of each peak, DN; 0: no ridge. @param peaks as they were measured, and are then.
  void measure(const Measured& frame, const std::vector<std::int32_t>& rises, PeakList& peaks);

  /// How many ridges of the last peaks were measured again.
  std::size_t again() const noexcept { return which_.size(); }

 private:
  template <typename Pixel>
  void continue_surfaces(const Measured& frame, const std::vector<std::int32_t>& rises,
                         const PeakList& peaks, std::size_t first);

  std::vector<std::size_t> which_;  // Of the peaks.
  PeakList again_;                  // As many of them as there are rows,
  LitFrame rows_;                   // and what is seen of each,
  cv::Mat lit_, dark_, masked_;     // in the room for it.
};

}  // namespace striper::detail
