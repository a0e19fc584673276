// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper {

/// The largest value of `lit - dark` in every chunk of 32 pixels of every line, and where it is:
/// all that one pass over an image must keep to find the peaks of each line.
///
/// The pass reads each pixel once, in memory order, with the widest vectors of the machine (chosen
/// at run time). `lit - dark` stops at 0, blind pixels count as 0, and among equal values the first
/// one wins. Two peaks of a line inside one chunk give one candidate, the higher one.
///
/// Along rows only the values are kept, and where they are is looked up for the chunks asked about:
/// until the next `find` the pixels must stay as they were.
///
/// No allocation after the first frame of a size. Not thread-safe.
class ChunkMaxima {
 public:
  static constexpr int kChunk = 32;
  static constexpr int kBest = 4;

  struct Peak {
    int across = 0;         ///< Pixel across the stripe: row for kColumns, column for kRows.
    int value_dn = 0;       ///< lit - dark there.
    int prominence_dn = 0;  ///< How far it rises above the darker one of its neighbouring chunks.
  };

  /// Reads `frame`, one line per column (kColumns) or row (kRows).
  void find(const LitFrame& frame, StripeAxis axis);

  /// Ranks the chunks of every line by prominence; needed before `best`.
  void rank();

  int lines() const noexcept { return lines_; }
  int chunks() const noexcept { return chunks_; }

  /// The first of the largest pixels of a chunk. Its prominence is not filled in.
  Peak at(int chunk, int line) const noexcept {
    const std::size_t i = static_cast<std::size_t>(chunk) * static_cast<std::size_t>(lines_) +
                          static_cast<std::size_t>(line);
    const std::uint32_t key = has_wide_keys_ ? keys16_[i] : keys8_[i];
    const auto value = static_cast<int>(has_wide_keys_ ? key >> 16 : key >> 8);
    if (axis_ == StripeAxis::kRows) return {across_in_row(chunk, line), value, 0};
    return {chunk * kChunk + kChunk - 1 - static_cast<int>(key & (kChunk - 1)), value, 0};
  }

  /// How prominent the `nth` most prominent chunk of a line is, 0 <= nth < kBest.
  int prominence_dn(int nth, int line) const noexcept {
    const std::uint32_t rank = rank_of(nth, line);
    return static_cast<int>(is_wide_ ? rank >> 16 : rank >> 8);
  }

  /// The chunk maximum that is the `nth` most prominent of a line, 0 <= nth < kBest. Prominence 0
  /// stands for none.
  Peak best(int nth, int line) const noexcept {
    const std::uint32_t rank = rank_of(nth, line);
    if (rank == 0) return {};
    Peak peak =
        at(static_cast<int>(is_wide_ ? 0xFFFF - (rank & 0xFFFF) : 0xFF - (rank & 0xFF)), line);
    peak.prominence_dn = static_cast<int>(is_wide_ ? rank >> 16 : rank >> 8);
    return peak;
  }

  /// Which pixel the most prominent chunk maximum of each line is at, all lines at once: `best(0,
  /// line).across`. Needs `rank`; room for `lines()` numbers.
  void best_across(std::int32_t* across) const noexcept;

  /// What else of a line may be the stripe, besides its most prominent chunk.
  struct RivalLimits {
    int second_dn = 1;  ///< What rises at least so far, at least 1,
    int flank_px = 0;  ///< but for the flank that a peak has in the next chunk, at most so far off.
    int weak_dn = 1;   ///< Where the most prominent one rises less, the ranks tell little.
  };
  struct Place {
    std::int32_t line;
    std::int32_t across;
  };
  struct Rivals {
    std::vector<Place> places;             ///< In order of lines, the more prominent first.
    std::vector<std::int32_t> weak_lines;  ///< In order; their places are not among `places`.
    std::vector<std::int32_t> flat_lines;  ///< Without any contrast; not among the weak ones.
  };

  /// Finds them. Needs `rank`.
  void find_rivals(const RivalLimits& limits, Rivals& rivals) const;

  /// Whether a pixel of the line was blind.
  bool is_partly_blind(int line) const noexcept {
    return !blind_.empty() && blind_[static_cast<std::size_t>(line)] != 0;
  }

 private:
  std::uint32_t rank_of(int nth, int line) const noexcept {
    const auto n = static_cast<std::size_t>(nth);
    const auto l = static_cast<std::size_t>(line);
    return is_wide_ ? best16_[n][l] : best8_[n][l];
  }

  void keep_images_of_rows(const LitFrame& frame);
  void find_best_in_rows();
  int across_in_row(int chunk, int line) const noexcept;
  void find_blind_lines(const LitFrame& frame, StripeAxis axis);

  StripeAxis axis_ = StripeAxis::kColumns;
  LitFrame row_images_;  // Those that maxima of rows are looked up in.
  int lines_ = 0;
  int chunks_ = 0;
  bool is_wide_ = false;  // 16-bit pixels, or so many chunks that 8 bits do not number them.
  bool has_wide_keys_ = false;
  // [chunk][line]: value << 8 | 31 - position in the chunk, which of rows is not known.
  std::vector<std::uint16_t> keys8_;
  std::vector<std::uint32_t> keys16_;  // The same with value << 16, for 16-bit pixels.
  std::array<std::vector<std::uint16_t>, kBest> best8_;   // [line]: prominence << 8 | 255 - chunk.
  std::array<std::vector<std::uint32_t>, kBest> best16_;  // prominence << 16 | 65535 - chunk.
  std::vector<std::uint16_t> best_across8_;               // [line]: pixel of the best chunk.
  std::vector<std::uint32_t> best_across16_;
  std::vector<std::uint8_t> blind_;  // [line]; empty without a blind mask.
};

}  // namespace striper
