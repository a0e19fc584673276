// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "ambient/pixels/line_kernels.hpp"

namespace striper::detail {

/// Follows a stripe that runs across the image from band to band of scan lines: of all paths the
/// one whose places rise highest above both of their sides, in sigmas of noise, by dynamic
/// programming.
///
/// No place counts for more than a clear stripe or for less than a gap may cost, and climbing costs
/// a little, or noise would find its own way. Noise alone gives paths of 0.4 to 1 a band, a clear
/// stripe up to kClear. No allocation after the first path of a length. Not thread-safe.
class LinePath {
 public:
  LinePath() = default;
  LinePath(const LinePath&) = delete;  // It points into itself.
  LinePath& operator=(const LinePath&) = delete;

  static constexpr float kClear = 5.0F;
  static constexpr float kGap = -1.0F;
  /// A stripe is no wider than this to either side; beyond are its sides.
  static constexpr int kSide = 7;

  /// Long bands are folded: the highest of so many neighbouring places stands for them.
  static int fold_of(int length) { return (length + kLongest - 1) / kLongest; }

  /// Folds the heights of a band. @param folded of `places()` elements.
  static void fold(std::span<const float> heights, std::span<float> folded) {
    const auto together = static_cast<std::size_t>(fold_of(static_cast<int>(heights.size())));
    for (std::size_t i = 0; i < folded.size(); ++i) {
      const std::size_t first = i * together;
      float highest = heights[first];
      for (std::size_t k = first + 1; k < std::min(first + together, heights.size()); ++k) {
        highest = std::max(highest, heights[k]);
      }
      folded[i] = highest;
    }
  }

  /// How many places a stripe may climb from one of the bands to the next. @param lines of the
  /// image, which the bands sample.
  static int most_jump(int lines, int bands) {
    const float climb = kSteepest * static_cast<float>(lines) / static_cast<float>(bands);
    return std::max(kLeastJump, static_cast<int>(std::ceil(climb)));
  }

  /// @param length of a band, before folding. @param jump places, before folding.
  void begin(int length, int jump) {
    const int fold = fold_of(length);
    places_ = (length + fold - 1) / fold;
    jump_ = (jump + fold - 1) / fold;
    // Nothing comes from beyond either end.
    constexpr float kNever = -1e6F;
    row_ = static_cast<std::size_t>(places_ + 2 * jump_);
    sums_.assign(2 * row_, kNever);
    best_ = sums_.data() + jump_;
    next_ = best_ + row_;
    std::fill(best_, best_ + places_, 0.0F);
    bands_ = 0;
  }

  /// Goes on through the next band. @param heights of its folded places, sigmas.
  void add(std::span<const float> heights) {
    PathStep{best_, next_, jump_, kTollPerJump, kGap, kClear}.take(
        heights.first(static_cast<std::size_t>(places_)));
    std::swap(best_, next_);
    ++bands_;
  }

  int places() const noexcept { return places_; }

  /// The mean height of the best path.
  float strength() const {
    return *std::max_element(best_, best_ + places_) / static_cast<float>(std::max(1, bands_));
  }

 private:
  static constexpr int kLongest = 512;
  static constexpr float kTollPerJump = 0.2F;
  static constexpr float kSteepest = 0.4F;
  static constexpr int kLeastJump = 3;

  int places_ = 0;
  int jump_ = 0;
  int bands_ = 0;
  std::size_t row_ = 0;
  std::vector<float> sums_;  // Of the paths that end at each place of this band and of the last.
  float* best_ = nullptr;
  float* next_ = nullptr;
};

}  // namespace striper::detail
