// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/stripe_axis.hpp>

#include "core/left_blank.hpp"

namespace striper::detail {

/// The highest ridges of every scan line: pixels that rise above both of the pixels a distance
/// before and after them across the stripe.
///
/// A stripe is a ridge and keeps its height (1 - exp(-distance^2 / 2 s^2) of it, for a sigma s), an
/// edge of the background has no rise at all, and a bright surface none but near its ends. So the
/// stripe shows between surfaces that are brighter than itself. Within two pixels the higher ridge
/// stands for both. At the image's borders the one neighbour that there is decides.
///
/// 10 us for 640x480, more where there are many ridges. No allocation after the first frame of a
/// size. Not thread-safe.
class Ridges {
 public:
  static constexpr std::size_t kMost = 24;  // Of a scan line; the lower ones are dropped.

  struct Ridge {
    std::int32_t across;
    std::int32_t rise_dn;
  };

  /// Makes room for images of this size.
  void reserve(const cv::Size& size, StripeAxis axis);

  /// @param image CV_8UC1 or CV_16UC1. @param least_dn of a rise, 1 or more.
  void find(const cv::Mat& image, StripeAxis axis, int distance_px, int least_dn);

  /// After `find`, puts the middle of a run of pixels of a scan line in the place of the ridges
  /// among them; that may be as near to a ridge beside the run as a pixel.
  void add_run(int line, int first, int last, int rise_dn);

  /// In no order. Precondition: `find`.
  std::span<const Ridge> of_line(int line) const noexcept {
    const Line& l = lines_[static_cast<std::size_t>(line)];
    return {l.ridges.data(), l.count};
  }

 private:
  struct Line {
    std::array<Ridge, kMost> ridges;
    std::size_t count;
    std::size_t latest;  // Which of them grew last; kMost: none that still does.
  };
  template <typename Pixel>
  void find_down(const cv::Mat& image, int distance_px, int least_dn);
  template <typename Pixel>
  void find_along(const cv::Mat& image, int distance_px, int least_dn);
  void add(Line& line, const Ridge& ridge) const;

  BlankVector<Line> lines_;
  std::vector<std::uint32_t> hits_;   // Of a row: pixels that rise far enough,
  std::vector<std::uint16_t> rises_;  // and how far.
  std::vector<std::uint8_t> padded_;  // A row with its ends repeated, of any pixels.
};

}  // namespace striper::detail
