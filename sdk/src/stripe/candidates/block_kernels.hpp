// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace striper::detail {

inline constexpr int kBlockPixels = 32;
inline constexpr int kBestBlocks = 4;
inline constexpr int kFirstBlocks = 2;

/// The images of a lit frame as the kernels read them. Strides in elements.
template <typename Pixel>
struct PixelPlanes {
  const Pixel* lit = nullptr;
  const Pixel* dark = nullptr;           // Null: nothing to subtract.
  const std::uint8_t* masked = nullptr;  // Null: none is masked.
  std::ptrdiff_t lit_stride = 0;
  std::ptrdiff_t dark_stride = 0;
  std::ptrdiff_t masked_stride = 0;
  int rows = 0;
  int cols = 0;
};

/// Of every block, at [block * lines + line]: its largest pixel, and how far from the block's first
/// pixel the first of the largest is.
void block_maxima_of_columns(const PixelPlanes<std::uint8_t>& planes, std::uint8_t* maxima,
                             std::uint8_t* positions);
void block_maxima_of_columns(const PixelPlanes<std::uint16_t>& planes, std::uint16_t* maxima,
                             std::uint16_t* positions);

/// The same without the positions: where in a row a maximum is costs less to look up than to keep.
void block_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, std::uint8_t* maxima);
void block_maxima_of_rows(const PixelPlanes<std::uint16_t>& planes, std::uint16_t* maxima);

/// Looks it up: of `count` rows from `first_row` on, across[i] is the first pixel of a block and
/// becomes the first of the block's largest ones.
void move_to_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, const std::uint8_t* maxima,
                            int first_row, int count, std::int32_t* across);
void move_to_maxima_of_rows(const PixelPlanes<std::uint16_t>& planes, const std::uint16_t* maxima,
                            int first_row, int count, std::int32_t* across);

/// The blocks of an image's scan lines.
template <typename Pixel>
struct Blocks {
  const Pixel* maxima = nullptr;
  const Pixel* positions = nullptr;  // Null: of rows.
  int lines = 0;
  int count = 0;  // Of a scan line.
};

/// Of every scan line the most prominent blocks, the most prominent first and of equal ones the
/// first, at [nth * lines + line]: how far they rise above the darker one of their neighbours, and
/// their numbers. Where nothing rises there is none.
template <typename Rank>
struct Ranking {
  int depth = kBestBlocks;     // Of so many, or of kFirstBlocks, and how far the next one rises.
  Rank* prominence = nullptr;  // Room for kBestBlocks, here and there.
  Rank* block = nullptr;
  // The pixel that the most prominent one has its maximum at, or begins at where positions are not
  // known. Where nothing rises it is the first one.
  std::int32_t* across = nullptr;
};

void rank_blocks(const Blocks<std::uint8_t>& blocks, const Ranking<std::uint8_t>& ranking);
void rank_blocks(const Blocks<std::uint8_t>& blocks, const Ranking<std::uint16_t>& ranking);
void rank_blocks(const Blocks<std::uint16_t>& blocks, const Ranking<std::uint16_t>& ranking);

}  // namespace striper::detail
