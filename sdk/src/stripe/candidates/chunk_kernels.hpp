// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace striper::detail {

inline constexpr int kChunkPixels = 32;
inline constexpr int kBestChunks = 4;
inline constexpr int kFirstChunks = 2;

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

/// Of every chunk, at [chunk * lines + line]: its largest pixel, and how far from the chunk's first
/// pixel the first of the largest is.
void chunk_maxima_of_columns(const PixelPlanes<std::uint8_t>& planes, std::uint8_t* maxima,
                             std::uint8_t* positions);
void chunk_maxima_of_columns(const PixelPlanes<std::uint16_t>& planes, std::uint16_t* maxima,
                             std::uint16_t* positions);

/// The same without the positions: where in a row a maximum is costs less to look up than to keep.
void chunk_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, std::uint8_t* maxima);
void chunk_maxima_of_rows(const PixelPlanes<std::uint16_t>& planes, std::uint16_t* maxima);

/// Looks it up: of `count` rows from `first_row` on, across[i] is the first pixel of a chunk and
/// becomes the first of the chunk's largest ones.
void move_to_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, const std::uint8_t* maxima,
                            int first_row, int count, std::int32_t* across);
void move_to_maxima_of_rows(const PixelPlanes<std::uint16_t>& planes, const std::uint16_t* maxima,
                            int first_row, int count, std::int32_t* across);

/// The chunks of an image's lines.
template <typename Pixel>
struct Chunks {
  const Pixel* maxima = nullptr;
  const Pixel* positions = nullptr;  // Null: of rows.
  int lines = 0;
  int count = 0;  // Of a line.
};

/// Of every line the most prominent chunks, the most prominent first and of equal ones the first,
/// at [nth * lines + line]: how far they rise above the darker one of their neighbours, and their
/// numbers. Where nothing rises there is none.
template <typename Rank>
struct Ranking {
  int depth = kBestChunks;     // Of so many, or of kFirstChunks, and how far the next one rises.
  Rank* prominence = nullptr;  // Room for kBestChunks, here and there.
  Rank* chunk = nullptr;
  // The pixel that the most prominent one has its maximum at, or begins at where positions are not
  // known. Where nothing rises it is the first one.
  std::int32_t* across = nullptr;
};

void rank_chunks(const Chunks<std::uint8_t>& chunks, const Ranking<std::uint8_t>& ranking);
void rank_chunks(const Chunks<std::uint8_t>& chunks, const Ranking<std::uint16_t>& ranking);
void rank_chunks(const Chunks<std::uint16_t>& chunks, const Ranking<std::uint16_t>& ranking);

}  // namespace striper::detail
