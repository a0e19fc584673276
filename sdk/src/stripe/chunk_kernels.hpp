// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace striper::detail {

inline constexpr int kChunkPixels = 32;
inline constexpr int kBestChunks = 4;

/// The images of a lit frame as the kernels read them. Strides in elements.
template <typename Pixel>
struct PixelPlanes {
  const Pixel* lit = nullptr;
  const Pixel* dark = nullptr;          // Null: nothing to subtract.
  const std::uint8_t* blind = nullptr;  // Null: none is blind.
  std::ptrdiff_t lit_stride = 0;
  std::ptrdiff_t dark_stride = 0;
  std::ptrdiff_t blind_stride = 0;
  int rows = 0;
  int cols = 0;
};

/// keys[chunk * lines + line] = value << 8 (16) | 31 - position in the chunk. The largest key of a
/// chunk is its first largest pixel.
void chunk_maxima_of_columns(const PixelPlanes<std::uint8_t>& planes, std::uint16_t* keys);
void chunk_maxima_of_columns(const PixelPlanes<std::uint16_t>& planes, std::uint32_t* keys);

/// The same with every position left at 0: where in a row a maximum is costs less to look up than
/// to keep.
void chunk_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, std::uint16_t* keys);
void chunk_maxima_of_rows(const PixelPlanes<std::uint16_t>& planes, std::uint32_t* keys);

/// Looks it up: of `count` rows from `first_row` on, across[i] is the first pixel of a chunk and
/// becomes the first of the chunk's largest ones. `keys` are those of chunk_maxima_of_rows.
void move_to_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, const std::uint16_t* keys,
                            int first_row, int count, std::uint16_t* across);
void move_to_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, const std::uint16_t* keys,
                            int first_row, int count, std::uint32_t* across);
void move_to_maxima_of_rows(const PixelPlanes<std::uint16_t>& planes, const std::uint32_t* keys,
                            int first_row, int count, std::uint32_t* across);

/// Of every line: its most prominent chunks, best first, as prominence << 8 (16) | 255 (65535) -
/// chunk; and the pixel that the first of them has its maximum at.
template <typename Rank>
struct Ranking {
  std::array<Rank*, kBestChunks> best{};
  Rank* across = nullptr;
};

void rank_chunks(const std::uint16_t* keys, int lines, int chunks,
                 const Ranking<std::uint16_t>& ranking);
void rank_chunks(const std::uint16_t* keys, int lines, int chunks,
                 const Ranking<std::uint32_t>& ranking);
void rank_chunks(const std::uint32_t* keys, int lines, int chunks,
                 const Ranking<std::uint32_t>& ranking);

}  // namespace striper::detail
