// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/types.hpp>

#include <striper/core/frame.hpp>

namespace striper::detail {

/// The part of a frame that shows a region of the full sensor: the same pixels, with a grid of its
/// own. A pixel belongs to it whose centre does. An interlaced frame is cut between its pairs of
/// rows, outwards, so that its fields stay what they are. Without pixels where nothing of the
/// region is in the frame. No copy of the image, no allocation.
Frame part_of(const Frame& frame, const cv::Rect& region_px);

}  // namespace striper::detail
