// SPDX-License-Identifier: Apache-2.0
// The chunk maxima of rows. Compiled for every instruction set: see hwy/foreach_target.h for the
// unusual include guard.
#if defined(STRIPER_STRIPE_CHUNK_ROWS_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_CHUNK_ROWS_INL_
#undef STRIPER_STRIPE_CHUNK_ROWS_INL_
#else
#define STRIPER_STRIPE_CHUNK_ROWS_INL_
#endif

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "stripe/chunk_reader-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

#if HWY_TARGET == HWY_SCALAR

template <typename R>
void rows(const R& reader, KeyOf<typename R::Pixel>* keys) {
  using Key = KeyOf<typename R::Pixel>;
  constexpr int kShift = 4 * sizeof(Key);
  for (int first = 0; first < reader.planes.cols; first += kChunkPixels) {
    const int count = std::min(kChunkPixels, reader.planes.cols - first);
    for (int row = 0; row < reader.planes.rows; ++row) {
      Key best = 0;
      for (int k = 0; k < count; ++k) {
        const auto value = static_cast<Key>(reader.value(row, first + k));
        best = std::max(best, static_cast<Key>(value << kShift | static_cast<Key>(kLast - k)));
      }
      *keys++ = best;
    }
  }
}

#else

// ---- Rows: pixels become keys (value, position), which a maximum folds together. As many rows as
// a 128-bit block has keys are folded at once, so that the result of a chunk is one block of keys,
// one per row. To turn lanes into one takes 55 instructions for eight vectors of AVX-512 where
// columns take 24: 2.3 times as long in the nearest caches, 1.5 times for 2 MB, the same from
// memory.

template <typename Pixel>
using KeyTag = hn::Repartition<KeyOf<Pixel>, PixelTag<Pixel> >;

template <typename Pixel>
using KeyVec = hn::Vec<KeyTag<Pixel> >;

template <typename Pixel>
inline constexpr int kRowsAtOnce = 16 / sizeof(KeyOf<Pixel>);

// The key parts "31 - position in the chunk" of the even and odd pixels of a vector.
template <typename Pixel>
struct Positions {
  KeyVec<Pixel> even;
  KeyVec<Pixel> odd;

  explicit HWY_INLINE Positions(int first_pixel) {
    const KeyTag<Pixel> dk;
    using Key = KeyOf<Pixel>;
    const auto lane = hn::Iota(dk, 0);
    const auto pixel = hn::Add(hn::Add(lane, lane), hn::Set(dk, static_cast<Key>(first_pixel)));
    const auto last = hn::Set(dk, static_cast<Key>(kLast));
    even = hn::Sub(last, hn::And(pixel, last));
    odd = hn::Sub(last, hn::And(hn::Add(pixel, hn::Set(dk, Key{1})), last));
  }

  // The larger key of each pair of pixels.
  HWY_INLINE KeyVec<Pixel> keys_of(PixelVec<Pixel> v) const {
    const KeyTag<Pixel> dk;
    using Key = KeyOf<Pixel>;
    constexpr int kShift = 4 * sizeof(Key);
    const auto pairs = hn::BitCast(dk, v);
    const auto high = hn::Set(dk, static_cast<Key>(~Key{0} << kShift));
    return hn::Max(hn::Or(hn::ShiftLeft<kShift>(pairs), even), hn::Or(hn::And(pairs, high), odd));
  }
};

// Lane j of a and of b become lanes of one vector, each the larger of two old lanes. `DW` is the
// tag whose lanes hold what belongs together.
template <class DW, class V>
HWY_INLINE V fold_pair(DW dw, V a, V b) {
  const hn::DFromV<V> dk;
  const auto wide_a = hn::BitCast(dw, a);
  const auto wide_b = hn::BitCast(dw, b);
  return hn::Max(hn::BitCast(dk, hn::InterleaveLower(dw, wide_a, wide_b)),
                 hn::BitCast(dk, hn::InterleaveUpper(dw, wide_a, wide_b)));
}

template <class V>
HWY_INLINE V fold_rows(const V (&k)[4]) {
  const hn::DFromV<V> dk;
  const hn::Repartition<std::uint64_t, decltype(dk)> d64;
  return fold_pair(d64, fold_pair(dk, k[0], k[1]), fold_pair(dk, k[2], k[3]));
}

template <class V>
HWY_INLINE V fold_rows(const V (&k)[8]) {
  const hn::DFromV<V> dk;
  const hn::Repartition<std::uint32_t, decltype(dk)> d32;
  const hn::Repartition<std::uint64_t, decltype(dk)> d64;
  const V abcd = fold_pair(d32, fold_pair(dk, k[0], k[1]), fold_pair(dk, k[2], k[3]));
  const V efgh = fold_pair(d32, fold_pair(dk, k[4], k[5]), fold_pair(dk, k[6], k[7]));
  return fold_pair(d64, abcd, efgh);
}

// Folds the blocks of one chunk together.
template <int kBlocks, class V>
HWY_INLINE V fold_blocks(V v) {
#if HWY_MAX_BYTES >= 32
  const hn::DFromV<V> dk;
  if constexpr (kBlocks >= 2) v = hn::Max(v, hn::SwapAdjacentBlocks(v));
  if constexpr (kBlocks >= 4) v = hn::Max(v, hn::ReverseBlocks(dk, v));
#endif
  return v;
}

template <typename Pixel>
struct RowsLayout {
  static constexpr int kLanes = static_cast<int>(HWY_MAX_BYTES / sizeof(Pixel));
  static constexpr int kVectorsPerChunk = kLanes >= kChunkPixels ? 1 : kChunkPixels / kLanes;
  static constexpr int kChunksPerVector = kLanes >= kChunkPixels ? kLanes / kChunkPixels : 1;
  static constexpr int kSpan = kLanes * kVectorsPerChunk;  // Pixels of a row done in one go.
  static constexpr int kBlocksPerChunk = HWY_MAX_BYTES / 16 / kChunksPerVector;
  static constexpr int kLanesPerBlock = 16 / sizeof(KeyOf<Pixel>);
};

// The chunk maxima of `kSpan` pixels of `row_count` rows from `row` on, as keys of chunks chunk,
// chunk + 1, ... of the lines from `line` on. All kRowsAtOnce rows are read. In line with its loop
// it would have more row addresses alive than there are registers.
template <typename R>
HWY_NOINLINE void span_of_rows(const R& reader, int row, int row_count, int col, int chunk,
                               int chunk_count, int lines, int line,
                               KeyOf<typename R::Pixel>* keys) {
  using Pixel = typename R::Pixel;
  using Key = KeyOf<Pixel>;
  using Layout = RowsLayout<Pixel>;
  const KeyTag<Pixel> dk;
  KeyVec<Pixel> per_row[kRowsAtOnce<Pixel>];
  const Positions<Pixel> positions(0);
  for (int j = 0; j < kRowsAtOnce<Pixel>; ++j) {
    per_row[j] = positions.keys_of(reader.load(row + j, col));
  }
  for (int q = 1; q < Layout::kVectorsPerChunk; ++q) {
    const Positions<Pixel> next(q * Layout::kLanes);
    for (int j = 0; j < kRowsAtOnce<Pixel>; ++j) {
      per_row[j] =
          hn::Max(per_row[j], next.keys_of(reader.load(row + j, col + q * Layout::kLanes)));
    }
  }
  const auto folded = fold_blocks<Layout::kBlocksPerChunk>(fold_rows(per_row));
  HWY_ALIGN Key result[HWY_MAX_BYTES / sizeof(Key)];
  hn::Store(folded, dk, result);
  for (int c = 0; c < Layout::kChunksPerVector && chunk + c < chunk_count; ++c) {
    Key* const to = keys + static_cast<std::ptrdiff_t>(chunk + c) * lines + line;
    const Key* const from = result + c * Layout::kBlocksPerChunk * Layout::kLanesPerBlock;
    if (row_count == kRowsAtOnce<Pixel>) {
      hwy::CopyBytes<kRowsAtOnce<Pixel> * sizeof(Key)>(from, to);
    } else {
      std::memcpy(to, from, static_cast<std::size_t>(row_count) * sizeof(Key));
    }
  }
}

// What is no whole span of rows or columns: copied into rows of their own, padded with zeros, which
// never win against a real pixel before them.
template <typename R>
HWY_NOINLINE void rest_of_rows(const R& reader, int row, int row_count, int col,
                               KeyOf<typename R::Pixel>* keys) {
  using Pixel = typename R::Pixel;
  using Layout = RowsLayout<Pixel>;
  const int cols = reader.planes.cols;
  const int chunk_count = (cols + kChunkPixels - 1) / kChunkPixels;
  Pixel padded[kRowsAtOnce<Pixel> * Layout::kSpan] = {};
  for (int j = 0; j < row_count; ++j) {
    for (int k = col; k < std::min(cols, col + Layout::kSpan); ++k) {
      padded[j * Layout::kSpan + k - col] = reader.value(row + j, k);
    }
  }
  PixelPlanes<Pixel> planes;
  planes.lit = padded;
  planes.lit_stride = Layout::kSpan;
  span_of_rows(Reader<Pixel, false, false>{planes}, 0, row_count, 0, col / kChunkPixels,
               chunk_count, reader.planes.rows, row, keys);
}

template <typename R>
void rows(const R& reader, KeyOf<typename R::Pixel>* keys) {
  using Pixel = typename R::Pixel;
  using Layout = RowsLayout<Pixel>;
  constexpr int kRows = kRowsAtOnce<Pixel>;
  const int lines = reader.planes.rows;
  const int cols = reader.planes.cols;
  const int chunk_count = (cols + kChunkPixels - 1) / kChunkPixels;
  for (int line = 0; line < lines; line += kRows) {
    // The last rows and spans may overlap those before them: the same keys are written twice.
    const int row = std::max(0, std::min(line, lines - kRows));
    const int row_count = std::min(kRows, lines);
    int col = 0;
    if (row_count == kRows) {
      for (; col + Layout::kSpan <= cols; col += Layout::kSpan) {
        span_of_rows(reader, row, kRows, col, col / kChunkPixels, chunk_count, lines, row, keys);
      }
      if (col < cols && cols % kChunkPixels == 0 && cols >= Layout::kSpan) {
        col = cols - Layout::kSpan;
        span_of_rows(reader, row, kRows, col, col / kChunkPixels, chunk_count, lines, row, keys);
        col = cols;
      }
    }
    for (; col < cols; col += Layout::kSpan) rest_of_rows(reader, row, row_count, col, keys);
  }
}

#endif  // HWY_TARGET == HWY_SCALAR

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_CHUNK_ROWS_INL_
