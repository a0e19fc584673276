// SPDX-License-Identifier: Apache-2.0
// The block maxima of rows. Compiled for every instruction set: see hwy/foreach_target.h for the
// unusual include guard.
#if defined(STRIPER_STRIPE_BLOCK_ROWS_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_BLOCK_ROWS_INL_
#undef STRIPER_STRIPE_BLOCK_ROWS_INL_
#else
#define STRIPER_STRIPE_BLOCK_ROWS_INL_
#endif

#include <algorithm>
#include <cstdint>

#include "stripe/candidates/block_reader-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

#if HWY_TARGET == HWY_SCALAR

template <typename R>
void rows(const R& reader, typename R::Pixel* maxima) {
  using Pixel = typename R::Pixel;
  for (int first = 0; first < reader.planes.cols; first += kBlockPixels) {
    const int end = std::min(first + kBlockPixels, reader.planes.cols);
    for (int row = 0; row < reader.planes.rows; ++row) {
      Pixel largest = 0;
      for (int col = first; col < end; ++col) largest = std::max(largest, reader.value(row, col));
      *maxima++ = largest;
    }
  }
}

#else

// ---- Rows: the pixels of a block are folded into one, of as many rows together as a 128-bit part
// has pixels, so that a part of the result holds a block's maxima, a row to a lane. To make one
// vector of two takes three instructions, in AVX-512 evenly for both of its ports: for a vector of
// pixels it comes to as many as columns take, which learn by them where the maxima are, too. Of
// rows that is looked up later, of the few blocks that matter.

// So many blocks are folded together, each into a part of its own.
constexpr int kBlocksAtOnce = HWY_MAX_BYTES / 16;
constexpr int kSpan = kBlocksAtOnce * kBlockPixels;

template <typename Pixel>
inline constexpr int kRowsAtOnce = 16 / sizeof(Pixel);

// Which part a block is in after `fold_parts`.
constexpr int part_of_block(int block) {
  return kBlocksAtOnce == 4 ? (block & 1) << 1 | block >> 1 : block;
}

// Halves, each of one block: those of a, then those of b.
template <class D, class V>
HWY_INLINE V fold_halves(D d, V a, V b) {
  return hn::Max(hn::ConcatUpperLower(d, b, a), hn::ConcatLowerUpper(d, b, a));
}

// Of two vectors whose neighbouring parts belong together, or which belong together where they are
// a part: one, a part to a block.
template <class D, class V>
HWY_INLINE V fold_parts(D d, V a, V b) {
#if HWY_MAX_BYTES == 64
  // Parts 1 of a, 0 of b, 3 of a, 2 of b: in one instruction.
  const V crossed{
      _mm512_permutex2var_epi64(a.raw, _mm512_setr_epi64(2, 3, 8, 9, 6, 7, 12, 13), b.raw)};
  return hn::Max(hn::OddEvenBlocks(b, a), crossed);
#elif HWY_MAX_BYTES == 32
  return fold_halves(d, a, b);
#else
  return hn::Max(a, b);
#endif
}

// kBlocksAtOnce blocks of a row, each folded into a part.
template <typename R>
HWY_INLINE PixelVec<typename R::Pixel> fold_blocks(const R& reader, int row, int col) {
  using Pixel = typename R::Pixel;
  const PixelTag<Pixel> d;
  constexpr int kLanes = static_cast<int>(HWY_MAX_BYTES / sizeof(Pixel));
  const auto vector = [&](int n) HWY_ATTR { return reader.load(d, row, col + n * kLanes); };
  if constexpr (sizeof(Pixel) == 1) {
    return fold_parts(d, vector(0), vector(1));
#if HWY_MAX_BYTES == 64
  } else {
    return fold_parts(d, fold_halves(d, vector(0), vector(1)),
                      fold_halves(d, vector(2), vector(3)));
#else
  } else {
    return fold_parts(d, hn::Max(vector(0), vector(1)), hn::Max(vector(2), vector(3)));
#endif
  }
}

// The same of kRows rows, which share the lanes: to halve what is left of a row leaves room for the
// next one.
template <int kRows, typename R>
HWY_INLINE PixelVec<typename R::Pixel> fold_rows(const R& reader, int row, int col) {
  using Pixel = typename R::Pixel;
  if constexpr (kRows == 1) {
    return fold_blocks(reader, row, col);
  } else {
    constexpr int kHalf = kRows / 2;
    const PixelTag<Pixel> d;
    const hn::Repartition<hwy::UnsignedFromSize<kHalf * sizeof(Pixel)>, PixelTag<Pixel> > together;
    const auto a = hn::BitCast(together, fold_rows<kHalf>(reader, row, col));
    const auto b = hn::BitCast(together, fold_rows<kHalf>(reader, row + kHalf, col));
    return hn::Max(hn::BitCast(d, hn::InterleaveLower(together, a, b)),
                   hn::BitCast(d, hn::InterleaveUpper(together, a, b)));
  }
}

// Where the maxima of some rows go: those of the first block to `first`, those of the next one
// `lines` further on.
template <typename Pixel>
struct MaximaOfRows {
  Pixel* first;
  std::ptrdiff_t lines;
  int rows;
  int blocks;

  template <int kRows>
  HWY_INLINE void put(int block, const Pixel (&maxima)[kRows]) const {
    Pixel* const to = first + block * lines;
    if (rows == kRows) {
      hwy::CopyBytes<sizeof(maxima)>(maxima, to);
    } else {
      std::copy_n(maxima, rows, to);
    }
  }
};

// Reads kSpan pixels of kRowsAtOnce rows.
template <typename R>
HWY_INLINE void span_of_rows(const R& reader, int row, int col, int block,
                             const MaximaOfRows<typename R::Pixel>& to) {
  using Pixel = typename R::Pixel;
  constexpr int kRows = kRowsAtOnce<Pixel>;
  const PixelTag<Pixel> d;
  HWY_ALIGN Pixel maxima[kBlocksAtOnce][kRows];
  hn::Store(fold_rows<kRows>(reader, row, col), d, maxima[0]);
  const int blocks = std::min(kBlocksAtOnce, to.blocks - block);
  for (int c = 0; c < blocks; ++c) to.put(block + c, maxima[part_of_block(c)]);
}

// What is no whole span of rows or columns: copied into rows of their own, padded with zeros, which
// never win against a real pixel before them.
template <typename R>
HWY_NOINLINE void rest_of_rows(const R& reader, int row, int col,
                               const MaximaOfRows<typename R::Pixel>& to) {
  using Pixel = typename R::Pixel;
  const PixelTag<Pixel> d;
  constexpr int kLanes = static_cast<int>(HWY_MAX_BYTES / sizeof(Pixel));
  constexpr int kStride = kLanes + kSpan;  // A row's last vector may begin before its first pixel.
  HWY_ALIGN Pixel padded[kRowsAtOnce<Pixel> * kStride] = {};
  const int end = std::min(reader.planes.cols, col + kSpan);
  for (int j = 0; j < to.rows; ++j) {
    Pixel* const copy = padded + j * kStride + kLanes;
    int k = col;
    for (; k + kLanes <= end; k += kLanes) hn::StoreU(reader.load(row + j, k), d, copy + (k - col));
    if (k < end && end >= kLanes) {
      k = end - kLanes;
      hn::StoreU(reader.load(row + j, k), d, copy + (k - col));
    } else {
      for (; k < end; ++k) copy[k - col] = reader.value(row + j, k);
    }
  }
  PixelPlanes<Pixel> planes;
  planes.lit = padded + kLanes;
  planes.lit_stride = kStride;
  span_of_rows(Reader<Pixel, false, false>{planes}, 0, 0, col / kBlockPixels, to);
}

template <typename R>
void rows(const R& reader, typename R::Pixel* maxima) {
  using Pixel = typename R::Pixel;
  constexpr int kRows = kRowsAtOnce<Pixel>;
  const int lines = reader.planes.rows;
  const int cols = reader.planes.cols;
  const int blocks = (cols + kBlockPixels - 1) / kBlockPixels;
  const int row_count = std::min(kRows, lines);
  for (int line = 0; line < lines; line += kRows) {
    // The last rows and spans may overlap those before them: the same maxima are written twice.
    const int row = std::max(0, std::min(line, lines - kRows));
    const MaximaOfRows<Pixel> to{maxima + row, lines, row_count, blocks};
    int col = 0;
    if (row_count == kRows) {
      for (; col + kSpan <= cols; col += kSpan) {
        span_of_rows(reader, row, col, col / kBlockPixels, to);
      }
      if (col < cols && cols % kBlockPixels == 0 && cols >= kSpan) {
        col = cols - kSpan;
        span_of_rows(reader, row, col, col / kBlockPixels, to);
        col = cols;
      }
    }
    for (; col < cols; col += kSpan) rest_of_rows(reader, row, col, to);
  }
}

#endif  // HWY_TARGET == HWY_SCALAR

// ---- Where in its block a maximum is.

template <typename R>
HWY_INLINE int first_in_block(const R& reader, int row, int col, typename R::Pixel value) {
  const hn::CappedTag<typename R::Pixel, kBlockPixels> d;
  const int n = static_cast<int>(hn::Lanes(d));
  const auto wanted = hn::Set(d, value);
  const int count = std::min(kBlockPixels, reader.planes.cols - col);
  int k = 0;
  for (; k + n <= count; k += n) {
    const auto at = hn::FindFirstTrue(d, hn::Eq(reader.load(d, row, col + k), wanted));
    if (at >= 0) return k + static_cast<int>(at);
  }
  while (k + 1 < count && reader.value(row, col + k) != value) ++k;
  return k;
}

template <typename R>
void move_to_maxima(const R& reader, const typename R::Pixel* maxima, int first_row, int count,
                    std::int32_t* across) {
  for (int i = 0; i < count; ++i) {
    const std::ptrdiff_t block = across[i] / kBlockPixels;
    const auto value = maxima[block * reader.planes.rows + first_row + i];
    across[i] += first_in_block(reader, first_row + i, across[i], value);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_BLOCK_ROWS_INL_
