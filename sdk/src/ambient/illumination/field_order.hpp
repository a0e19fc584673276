// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

namespace striper::detail {

/// How many parts of a frame say that its fields are in the right order, and how many the
/// contrary.
struct OrderVotes {
  int right = 0;
  int wrong = 0;

  int all() const { return right + wrong; }
};

/// How far a search for what moved goes, in bands and samples.
struct OrderSearch {
  int bands = 0;
  int samples = 0;
};

/// Asks where things were in between: whatever has moved from the first field of a frame to the
/// first field of the next one was half-way in the second field, if that came between them. If it
/// came before the first, things were as far on the other side.
///
/// Block by block: where a block of `first` is found again in `next`, somewhere else and plainly,
/// `second` is compared with it half-way and as far behind.
/// @param first, second, next profiles of a size but for a sample, CV_32F, a band a row (see
/// band_profiles).
OrderVotes vote_on_order(const cv::Mat& first, const cv::Mat& second, const cv::Mat& next,
                         const OrderSearch& search);

}  // namespace striper::detail
