// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "stripe/profile/peak_seed.hpp"

namespace striper::detail {

/// The largest value of `lit - dark` in every block of 32 pixels of every scan line, and where it
/// is: all that one pass over an image must keep to find the peaks of each scan line.
///
/// The pass reads each pixel once, in memory order, with the widest vectors of the machine (chosen
/// at run time). `lit - dark` stops at 0, masked pixels count as 0, and among equal values the
/// first one wins. Two peaks of a scan line inside one block give one candidate, the higher one.
///
/// Along rows only the values are kept, and where they are is looked up for the blocks asked about:
/// until the next `find` the pixels must stay where and as they are.
///
/// No allocation after the first frame of a size. Not thread-safe.
class BlockMaxima {
 public:
  BlockMaxima() = default;
  BlockMaxima(BlockMaxima&&) = default;  // A copy would share what is kept.
  BlockMaxima& operator=(BlockMaxima&&) = default;

  static constexpr int kBlock = 32;
  static constexpr int kBest = 4;
  static constexpr int kFirst = 2;

  struct Peak {
    int across = 0;         ///< Pixel across the stripe: row for kColumns, column for kRows.
    int value_dn = 0;       ///< lit - dark there.
    int prominence_dn = 0;  ///< How far it rises above the darker one of its neighbouring blocks.
  };

  /// Reads `frame`, one scan line per column (kColumns) or row (kRows).
  void find(const LitFrame& frame, StripeAxis axis);

  /// Ranks the blocks of every scan line by prominence; needed before `best`. @param depth how many
  /// of a scan line: kBest, or kFirst, which takes less time and tells also how prominent the next
  /// one is.
  void rank(int depth = kBest);

  int lines() const noexcept { return lines_; }
  int blocks() const noexcept { return blocks_; }

  /// The first of the largest pixels of a block. Its prominence is not filled in.
  Peak at(int block, int line) const noexcept {
    const int across = axis_ == StripeAxis::kRows
                           ? across_in_row(block, line)
                           : block * kBlock + number_at(positions_, block, line);
    return {across, number_at(maxima_, block, line), 0};
  }

  /// How prominent the `nth` most prominent block of a scan line is, 0 <= nth < kBest; nth <=
  /// kFirst where ranked to kFirst.
  int prominence_dn(int nth, int line) const noexcept { return number_at(prominences_, nth, line); }

  /// The block maximum that is the `nth` most prominent of a scan line, 0 <= nth < the depth ranked
  /// to; of equal ones the first. Prominence 0 stands for none.
  Peak best(int nth, int line) const noexcept {
    const int prominence = prominence_dn(nth, line);
    if (prominence == 0) return {};
    Peak peak = at(number_at(best_blocks_, nth, line), line);
    peak.prominence_dn = prominence;
    return peak;
  }

  /// Which pixel the most prominent block maximum of each scan line is at, that of the first block
  /// in a scan line without any contrast. Needs `rank`.
  const std::vector<std::int32_t>& best_across() const noexcept { return best_across_; }

  /// What else of a scan line may be the stripe, besides its most prominent block.
  struct RivalLimits {
    int second_dn = 1;  ///< What rises at least so far, at least 1,
    int flank_px = 0;  ///< but for the flank that a peak has in the next block, at most so far off.
    int weak_dn = 1;   ///< Where the most prominent one rises less, the ranks tell little.
  };
  using Place = PeakSeed;
  struct Rivals {
    std::vector<Place> places;             ///< In order of scan lines, the more prominent first.
    std::vector<std::int32_t> weak_lines;  ///< In order; their places are not among `places`.
    std::vector<std::int32_t> flat_lines;  ///< Without any contrast; not among the weak ones.
  };

  /// Finds them. Needs `rank`, and ranks to kBest itself where a scan line has so many.
  void find_rivals(const RivalLimits& limits, Rivals& rivals);

  /// The largest `lit - dark` of a scan line; masked pixels count as 0.
  int brightest_dn(int line) const noexcept {
    int brightest = 0;
    for (int block = 0; block < blocks_; ++block) {
      brightest = std::max(brightest, number_at(maxima_, block, line));
    }
    return brightest;
  }

  /// How much the maxima of two blocks of a scan line that are next to one another differ at most.
  int largest_step_dn(int line) const noexcept {
    int largest = 0;
    for (int block = 1; block < blocks_; ++block) {
      const int step = number_at(maxima_, block, line) - number_at(maxima_, block - 1, line);
      largest = std::max(largest, std::abs(step));
    }
    return largest;
  }

  /// Whether a pixel of the scan line was masked.
  bool is_partly_masked(int line) const noexcept {
    return !masked_.empty() && masked_[static_cast<std::size_t>(line)] != 0;
  }

 private:
  static int number_at(const cv::Mat& numbers, int row, int line) noexcept {
    return numbers.depth() == CV_8U ? numbers.ptr<std::uint8_t>(row)[line]
                                    : numbers.ptr<std::uint16_t>(row)[line];
  }

  // Where the pixels are; who gave them keeps them. Strides in elements.
  struct Images {
    const void* lit = nullptr;
    const void* dark = nullptr;
    const std::uint8_t* masked = nullptr;
    std::ptrdiff_t lit_stride = 0, dark_stride = 0, masked_stride = 0;
    int rows = 0, cols = 0;
  };
  static Images images_of(const LitFrame& frame);
  template <typename Pixel>
  void find_in();
  template <typename Pixel, typename Rank>
  void rank_in();
  template <typename Rank>
  void find_rivals_in(const RivalLimits& limits, Rivals& rivals);
  void find_rivals_of(int line, const RivalLimits& limits, Rivals& rivals);
  template <typename Pixel>
  void move_in_rows(int first_line, int count, std::int32_t* across) const noexcept;
  int across_in_row(int block, int line) const noexcept;
  void find_masked_lines(const LitFrame& frame, StripeAxis axis);

  StripeAxis axis_ = StripeAxis::kColumns;
  Images images_;  // Maxima of rows are looked up in them.
  int lines_ = 0;
  int blocks_ = 0;
  int depth_ = kBest;  // That the blocks are ranked to.
  // A column per scan line, in 8 or in 16 bits. Of a row per block: the largest pixel, and where in
  // the block, which along rows is not known.
  cv::Mat maxima_, positions_;
  // Of kBest rows; in 16 bits where the pixels or the numbers of the blocks need them.
  cv::Mat prominences_, best_blocks_;
  std::vector<std::int32_t> best_across_;  // [line]
  std::vector<std::uint8_t> masked_;       // [line]; empty without a mask.
};

}  // namespace striper::detail
