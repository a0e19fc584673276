// SPDX-License-Identifier: Apache-2.0
// The block maxima of columns. Compiled for every instruction set: see hwy/foreach_target.h for the
// unusual include guard.
#if defined(STRIPER_STRIPE_BLOCK_COLUMNS_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_BLOCK_COLUMNS_INL_
#undef STRIPER_STRIPE_BLOCK_COLUMNS_INL_
#else
#define STRIPER_STRIPE_BLOCK_COLUMNS_INL_
#endif

#include <algorithm>
#include <cstdint>

#include "stripe/candidates/block_reader-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

// ---- Columns: the rows of a block are folded into running maxima, a strip of columns at a time.

template <typename Pixel>
struct Running {
  PixelVec<Pixel> maximum;
  PixelVec<Pixel> position;  // Row in the block.

  HWY_INLINE void fold(PixelVec<Pixel> v, PixelVec<Pixel> row_position) {
    const auto larger = hn::Max(maximum, v);
    // An unsigned "greater" costs three instructions before AVX-512, "equal" one.
    position = hn::IfThenElse(hn::Eq(larger, maximum), position, row_position);
    maximum = larger;
  }
};

// What is kept of one block of every column.
template <typename Pixel>
struct BlockOfColumns {
  Pixel* maxima;
  Pixel* positions;

  HWY_INLINE Running<Pixel> load(int col) const {
    const PixelTag<Pixel> d;
    return {hn::LoadU(d, maxima + col), hn::LoadU(d, positions + col)};
  }

  HWY_INLINE void store(const Running<Pixel>& running, int col) const {
    const PixelTag<Pixel> d;
    hn::StoreU(running.maximum, d, maxima + col);
    hn::StoreU(running.position, d, positions + col);
  }
};

constexpr int kRowGroup = 2;
static_assert(kBlockPixels % kRowGroup == 0);

// Folds rows from `first` to `end` of the block that begins at `row`, so many vectors side by side.
// Rows in groups of a number known beforehand, whose loop is gone.
template <int kVectors, typename R>
HWY_INLINE void fold_strip(const R& reader, int row, int first, int end, int col,
                           const BlockOfColumns<typename R::Pixel>& block) {
  using Pixel = typename R::Pixel;
  const PixelTag<Pixel> d;
  const int n = static_cast<int>(hn::Lanes(d));
  Running<Pixel> running[kVectors];
  for (int v = 0; v < kVectors; ++v) {
    running[v] = {hn::Zero(d), hn::Zero(d)};
    if (first > 0) running[v] = block.load(col + v * n);
  }
  auto position = hn::Set(d, static_cast<Pixel>(first));
  const auto fold_row = [&](int k) HWY_ATTR {
    for (int v = 0; v < kVectors; ++v) {
      running[v].fold(reader.load(row + k, col + v * n), position);
    }
    position = hn::Add(position, hn::Set(d, Pixel{1}));
  };
  int k = first;
  for (; k + kRowGroup <= end; k += kRowGroup) {
    for (int i = 0; i < kRowGroup; ++i) fold_row(k + i);
  }
  for (; k < end; ++k) fold_row(k);
  for (int v = 0; v < kVectors; ++v) block.store(running[v], col + v * n);
}

template <typename R>
void narrow_block(const R& reader, int row, int rows,
                  const BlockOfColumns<typename R::Pixel>& block) {
  using Pixel = typename R::Pixel;
  for (int col = 0; col < reader.planes.cols; ++col) {
    Pixel maximum = 0;
    int position = 0;
    for (int k = 0; k < rows; ++k) {
      const Pixel value = reader.value(row + k, col);
      if (value > maximum) position = k;
      maximum = std::max(maximum, value);
    }
    block.maxima[col] = maximum;
    block.positions[col] = static_cast<Pixel>(position);
  }
}

// What every instruction set has registers for, and what those with 32 have.
constexpr int kStrip = 5;
#if HWY_TARGET <= HWY_AVX3
constexpr int kBroadStrip = 2 * kStrip;
#else
constexpr int kBroadStrip = kStrip;
#endif

// Of a wide image so many rows are folded at a time. Each is a stream to the processor's own
// prefetching, which with twice as many, and those of the dark image, loses track.
constexpr int kRowsPerVisit = 4;

// Asks for as much of the rows from `row` on as the strip at `col` has pixels, in the order that
// memory gives fastest: one row after the other, where folding goes down through all of them.
template <typename R>
HWY_INLINE void ask_for_rows_after(const R& reader, int row, int col, int cols) {
  using Pixel = typename R::Pixel;
  const int after = kRowsPerVisit * col;
  const int down = after / cols;
  if (row + down >= reader.planes.rows) return;
  constexpr int kLine = 64 / static_cast<int>(sizeof(Pixel));
  const int strip = kStrip * static_cast<int>(hn::Lanes(PixelTag<Pixel>()));
  for (int i = 0; i < kRowsPerVisit * strip; i += kLine) {
    reader.prefetch(row + down, after - down * cols + i);
  }
}

// Returns how many columns were done: a multiple of a strip.
template <typename R>
int wide_block(const R& reader, int row, int rows, const BlockOfColumns<typename R::Pixel>& block) {
  const int step = kStrip * static_cast<int>(hn::Lanes(PixelTag<typename R::Pixel>()));
  const int cols = reader.planes.cols / step * step;
  for (int k = 0; k < rows; k += kRowsPerVisit) {
    const int end = std::min(k + kRowsPerVisit, rows);
    for (int col = 0; col < cols; col += step) {
      ask_for_rows_after(reader, row + end, col, cols);
      fold_strip<kStrip>(reader, row, k, end, col, block);
    }
  }
  return cols;
}

constexpr int kWideBytes = 1536;

template <typename R>
void columns(const R& reader, typename R::Pixel* maxima, typename R::Pixel* positions) {
  using Pixel = typename R::Pixel;
  const int n = static_cast<int>(hn::Lanes(PixelTag<Pixel>()));
  const int cols = reader.planes.cols;
  const bool is_wide = cols * static_cast<int>(sizeof(Pixel)) >= kWideBytes;
  BlockOfColumns<Pixel> block{maxima, positions};
  for (int row = 0; row < reader.planes.rows; row += kBlockPixels) {
    const int rows = std::min(kBlockPixels, reader.planes.rows - row);
    if (cols < n) {
      narrow_block(reader, row, rows, block);
    } else {
      int col = is_wide ? wide_block(reader, row, rows, block) : 0;
      for (; col + kBroadStrip * n <= cols; col += kBroadStrip * n) {
        fold_strip<kBroadStrip>(reader, row, 0, rows, col, block);
      }
      for (; col + kStrip * n <= cols; col += kStrip * n) {
        fold_strip<kStrip>(reader, row, 0, rows, col, block);
      }
      for (; col + 2 * n <= cols; col += 2 * n) fold_strip<2>(reader, row, 0, rows, col, block);
      for (; col + n <= cols; col += n) fold_strip<1>(reader, row, 0, rows, col, block);
      // The last strip may overlap the one before it: the same is written twice.
      if (col < cols) fold_strip<1>(reader, row, 0, rows, cols - n, block);
    }
    block.maxima += cols;
    block.positions += cols;
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_BLOCK_COLUMNS_INL_
