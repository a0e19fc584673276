// SPDX-License-Identifier: Apache-2.0
// The chunk maxima of columns. Compiled for every instruction set: see hwy/foreach_target.h for the
// unusual include guard.
#if defined(STRIPER_STRIPE_CHUNK_COLUMNS_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_CHUNK_COLUMNS_INL_
#undef STRIPER_STRIPE_CHUNK_COLUMNS_INL_
#else
#define STRIPER_STRIPE_CHUNK_COLUMNS_INL_
#endif

#include <algorithm>
#include <cstdint>

#include "stripe/chunk_reader-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

// ---- Columns: the rows of a chunk are folded into running maxima, a strip of columns at a time.

template <typename Pixel>
struct Running {
  PixelVec<Pixel> maximum;
  PixelVec<Pixel> position;  // 31 - row in the chunk.

  HWY_INLINE void fold(PixelVec<Pixel> v, PixelVec<Pixel> row_position) {
    const auto larger = hn::Max(maximum, v);
    // An unsigned "greater" costs three instructions before AVX-512, "equal" one.
    position = hn::IfThenElse(hn::Eq(larger, maximum), position, row_position);
    maximum = larger;
  }

  HWY_INLINE void store(KeyOf<Pixel>* keys) const {
    // Little endian: position in the low half, value in the high half of a key.
    hn::StoreInterleaved2(position, maximum, PixelTag<Pixel>(), reinterpret_cast<Pixel*>(keys));
  }
};

constexpr int kRowBlock = 8;
static_assert(kChunkPixels % kRowBlock == 0);

// So many vectors side by side. Rows in blocks of a number known beforehand, whose loop is gone.
template <int kVectors, typename R>
HWY_INLINE void strip_of(const R& reader, int row, int rows, int col,
                         KeyOf<typename R::Pixel>* keys) {
  using Pixel = typename R::Pixel;
  const PixelTag<Pixel> d;
  const int n = static_cast<int>(hn::Lanes(d));
  auto position = hn::Set(d, static_cast<Pixel>(kLast));
  Running<Pixel> running[kVectors];
  for (auto& r : running) r = {hn::Zero(d), position};
  const auto fold_row = [&](int k) HWY_ATTR {
    for (int v = 0; v < kVectors; ++v) {
      running[v].fold(reader.load(row + k, col + v * n), position);
    }
    position = hn::Sub(position, hn::Set(d, Pixel{1}));
  };
  int k = 0;
  for (; k + kRowBlock <= rows; k += kRowBlock) {
    for (int i = 0; i < kRowBlock; ++i) fold_row(k + i);
  }
  for (; k < rows; ++k) fold_row(k);
  for (int v = 0; v < kVectors; ++v) running[v].store(keys + col + v * n);
}

template <typename R>
void narrow_columns(const R& reader, int row, int rows, int cols, KeyOf<typename R::Pixel>* keys) {
  for (int col = 0; col < cols; ++col) {
    KeyOf<typename R::Pixel> best = 0;
    for (int k = 0; k < rows; ++k) best = std::max(best, key_of(reader.value(row + k, col), k));
    keys[col] = best;
  }
}

// A wide image is read a few whole rows at a time, which is the order that memory gives fastest;
// the running maxima of the chunk wait in `maxima` and `positions`, which stay in the nearest
// cache.
template <typename R>
HWY_INLINE void fold_rows_of_strip(const R& reader, int row, int rows, int col, bool is_first,
                                   typename R::Pixel* maxima, typename R::Pixel* positions,
                                   int row_in_chunk) {
  using Pixel = typename R::Pixel;
  const PixelTag<Pixel> d;
  const int n = static_cast<int>(hn::Lanes(d));
  const auto first = hn::Set(d, static_cast<Pixel>(kLast));
  Running<Pixel> a{hn::Zero(d), first};
  Running<Pixel> b{hn::Zero(d), first};
  if (!is_first) {
    a = {hn::LoadU(d, maxima + col), hn::LoadU(d, positions + col)};
    b = {hn::LoadU(d, maxima + col + n), hn::LoadU(d, positions + col + n)};
  }
  for (int k = 0; k < rows; ++k) {
    const auto position = hn::Set(d, static_cast<Pixel>(kLast - row_in_chunk - k));
    a.fold(reader.load(row + k, col), position);
    b.fold(reader.load(row + k, col + n), position);
  }
  hn::StoreU(a.maximum, d, maxima + col);
  hn::StoreU(a.position, d, positions + col);
  hn::StoreU(b.maximum, d, maxima + col + n);
  hn::StoreU(b.position, d, positions + col + n);
}

constexpr int kRowsPerVisit = 16;
constexpr int kWidestBuffered = 16384;

// Returns how many columns were done: a multiple of two vectors.
template <typename R>
int wide_chunk(const R& reader, int row, int rows, KeyOf<typename R::Pixel>* keys) {
  using Pixel = typename R::Pixel;
  const PixelTag<Pixel> d;
  const int n = static_cast<int>(hn::Lanes(d));
  const int cols = std::min(reader.planes.cols, kWidestBuffered) / (2 * n) * (2 * n);
  HWY_ALIGN Pixel maxima[kWidestBuffered];
  HWY_ALIGN Pixel positions[kWidestBuffered];
  for (int k = 0; k < rows; k += kRowsPerVisit) {
    const int count = std::min(kRowsPerVisit, rows - k);
    for (int col = 0; col < cols; col += 2 * n) {
      fold_rows_of_strip(reader, row + k, count, col, k == 0, maxima, positions, k);
    }
  }
  for (int col = 0; col < cols; col += n) {
    Running<Pixel>{hn::LoadU(d, maxima + col), hn::LoadU(d, positions + col)}.store(keys + col);
  }
  return cols;
}

constexpr int kWideBytes = 1536;
// What every instruction set has registers for.
constexpr int kStrip = 5;

template <typename R>
void columns(const R& reader, KeyOf<typename R::Pixel>* keys) {
  using Pixel = typename R::Pixel;
  const int n = static_cast<int>(hn::Lanes(PixelTag<Pixel>()));
  const int cols = reader.planes.cols;
  const bool is_wide = cols * static_cast<int>(sizeof(Pixel)) >= kWideBytes;
  for (int row = 0; row < reader.planes.rows; row += kChunkPixels, keys += cols) {
    const int rows = std::min(kChunkPixels, reader.planes.rows - row);
    if (cols < n) {
      narrow_columns(reader, row, rows, cols, keys);
      continue;
    }
    int col = is_wide ? wide_chunk(reader, row, rows, keys) : 0;
    for (; col + kStrip * n <= cols; col += kStrip * n) {
      strip_of<kStrip>(reader, row, rows, col, keys);
    }
    for (; col + 2 * n <= cols; col += 2 * n) strip_of<2>(reader, row, rows, col, keys);
    for (; col + n <= cols; col += n) strip_of<1>(reader, row, rows, col, keys);
    // The last strip may overlap the one before it: the same keys are written twice.
    if (col < cols) strip_of<1>(reader, row, rows, cols - n, keys);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_CHUNK_COLUMNS_INL_
