// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper::detail {

/// Corrects what clipping does to a colour difference such as green - red.
///
/// Where the laser's stripe is clipped to white both colours are alike: the difference shows the
/// two flanks of the stripe, each like a stripe, and is hollow between them, where it is. There the
/// other colour is the stripe's own light and not the scene's, which is read instead beyond the
/// flanks; the stripe is then what it is in its own colour. What is clipped in both colours and is
/// no such stripe (a light source, a sheet in the sun) is masked.
///
/// Reads the laser's colour once where nothing is clipped, and both colours where something is;
/// what that takes, `ambient_bench --benchmark_filter=colour` says. No allocation after the first
/// frame of a size. Not thread-safe.
class ColourDifference {
 public:
  /// @param frame with the laser's colour in `lit` and the other one in `dark`, CV_8UC1 or CV_16UC1
  /// (`select_channel`), which are not written into: `frame.dark` and `frame.masked` become
  /// matrices of this object, valid until the next call, where anything is clipped.
  void correct(LitFrame& frame, StripeAxis axis);

  /// From the first to the last clipped pixel of a scan line; none where `last` is before `first`.
  struct Span {
    int first;
    int last;
  };

 private:
  cv::Mat filled_;
  cv::Mat masked_;
  std::vector<Span> clipped_;  // [line]
};

}  // namespace striper::detail
