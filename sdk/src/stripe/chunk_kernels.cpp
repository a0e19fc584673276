// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "stripe/chunk_kernels.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/chunk_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

template <typename Pixel>
using KeyOf = std::conditional_t<std::is_same_v<Pixel, std::uint8_t>, std::uint16_t, std::uint32_t>;

constexpr int kLast = kChunkPixels - 1;

template <typename Pixel>
using PixelTag = hn::ScalableTag<Pixel>;

template <typename Pixel>
using PixelVec = hn::Vec<PixelTag<Pixel>>;

template <typename Pixel>
HWY_INLINE PixelVec<Pixel> load_blind(const std::uint8_t* blind) {
  const PixelTag<Pixel> d;
  if constexpr (sizeof(Pixel) == 1) {
    return hn::LoadU(d, blind);
  } else {
    const hn::Rebind<std::uint8_t, decltype(d)> half;
    return hn::PromoteTo(d, hn::LoadU(half, blind));
  }
}

// What the planes hold, known when the loop is compiled: a plane that is absent costs nothing.
template <typename PixelT, bool kHasDark, bool kHasBlind>
struct Reader {
  using Pixel = PixelT;

  PixelPlanes<Pixel> planes;

  HWY_INLINE PixelVec<Pixel> load(int row, int col) const {
    const PixelTag<Pixel> d;
    auto v = hn::LoadU(d, planes.lit + row * planes.lit_stride + col);
    if constexpr (kHasDark) {
      v = hn::SaturatedSub(v, hn::LoadU(d, planes.dark + row * planes.dark_stride + col));
    }
    if constexpr (kHasBlind) {
      const auto seen =
          hn::Eq(load_blind<Pixel>(planes.blind + row * planes.blind_stride + col), hn::Zero(d));
      v = hn::IfThenElseZero(seen, v);
    }
    return v;
  }

  Pixel value(int row, int col) const {
    if (kHasBlind && planes.blind[row * planes.blind_stride + col] != 0) return 0;
    const Pixel lit = planes.lit[row * planes.lit_stride + col];
    if constexpr (!kHasDark) return lit;
    const Pixel dark = planes.dark[row * planes.dark_stride + col];
    return lit > dark ? static_cast<Pixel>(lit - dark) : Pixel{0};
  }
};

template <typename Visitor, typename Pixel>
void with_reader(const PixelPlanes<Pixel>& planes, const Visitor& visit) {
  const bool dark = planes.dark != nullptr;
  if (planes.blind != nullptr) {
    if (dark) {
      visit(Reader<Pixel, true, true>{planes});
    } else {
      visit(Reader<Pixel, false, true>{planes});
    }
  } else if (dark) {
    visit(Reader<Pixel, true, false>{planes});
  } else {
    visit(Reader<Pixel, false, false>{planes});
  }
}

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

// Four vectors side by side: enough independent work, and eight registers of accumulators.
template <typename R>
HWY_INLINE void strip_of_four(const R& reader, int row, int rows, int col,
                              KeyOf<typename R::Pixel>* keys) {
  using Pixel = typename R::Pixel;
  const PixelTag<Pixel> d;
  const int n = static_cast<int>(hn::Lanes(d));
  const auto first = hn::Set(d, static_cast<Pixel>(kLast));
  Running<Pixel> a{reader.load(row, col), first};
  Running<Pixel> b{reader.load(row, col + n), first};
  Running<Pixel> c{reader.load(row, col + 2 * n), first};
  Running<Pixel> e{reader.load(row, col + 3 * n), first};
  for (int k = 1; k < rows; ++k) {
    const auto position = hn::Set(d, static_cast<Pixel>(kLast - k));
    a.fold(reader.load(row + k, col), position);
    b.fold(reader.load(row + k, col + n), position);
    c.fold(reader.load(row + k, col + 2 * n), position);
    e.fold(reader.load(row + k, col + 3 * n), position);
  }
  a.store(keys + col);
  b.store(keys + col + n);
  c.store(keys + col + 2 * n);
  e.store(keys + col + 3 * n);
}

template <typename R>
HWY_INLINE void strip_of_one(const R& reader, int row, int rows, int col,
                             KeyOf<typename R::Pixel>* keys) {
  using Pixel = typename R::Pixel;
  const PixelTag<Pixel> d;
  Running<Pixel> a{reader.load(row, col), hn::Set(d, static_cast<Pixel>(kLast))};
  for (int k = 1; k < rows; ++k) {
    a.fold(reader.load(row + k, col), hn::Set(d, static_cast<Pixel>(kLast - k)));
  }
  a.store(keys + col);
}

template <typename R>
void narrow_columns(const R& reader, int row, int rows, int cols, KeyOf<typename R::Pixel>* keys) {
  using Key = KeyOf<typename R::Pixel>;
  constexpr int kShift = 4 * sizeof(Key);
  for (int col = 0; col < cols; ++col) {
    Key best = 0;
    for (int k = 0; k < rows; ++k) {
      const auto value = static_cast<Key>(reader.value(row + k, col));
      best = std::max(best, static_cast<Key>(value << kShift | static_cast<Key>(kLast - k)));
    }
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
    for (; col + 4 * n <= cols; col += 4 * n) strip_of_four(reader, row, rows, col, keys);
    for (; col + n <= cols; col += n) strip_of_one(reader, row, rows, col, keys);
    // The last strip may overlap the one before it: the same keys are written twice.
    if (col < cols) strip_of_one(reader, row, rows, cols - n, keys);
  }
}

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
// one per row.

template <typename Pixel>
using KeyTag = hn::Repartition<KeyOf<Pixel>, PixelTag<Pixel>>;

template <typename Pixel>
using KeyVec = hn::Vec<KeyTag<Pixel>>;

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
// chunk + 1, ... of the lines from `line` on. All kRowsAtOnce rows are read.
template <typename R>
HWY_INLINE void span_of_rows(const R& reader, int row, int row_count, int col, int chunk,
                             int chunk_count, int lines, int line, KeyOf<typename R::Pixel>* keys) {
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

void columns_u8(const PixelPlanes<std::uint8_t>& planes, std::uint16_t* keys) {
  with_reader(planes, [&](const auto& reader) { columns(reader, keys); });
}
void columns_u16(const PixelPlanes<std::uint16_t>& planes, std::uint32_t* keys) {
  with_reader(planes, [&](const auto& reader) { columns(reader, keys); });
}
void rows_u8(const PixelPlanes<std::uint8_t>& planes, std::uint16_t* keys) {
  with_reader(planes, [&](const auto& reader) { rows(reader, keys); });
}
void rows_u16(const PixelPlanes<std::uint16_t>& planes, std::uint32_t* keys) {
  with_reader(planes, [&](const auto& reader) { rows(reader, keys); });
}

// ---- Ranking.

// Keys in lanes of the ranks.
template <class D, typename Key>
HWY_INLINE hn::Vec<D> load_keys(D d, const Key* keys) {
  if constexpr (sizeof(Key) == sizeof(hn::TFromD<D>)) {
    return hn::LoadU(d, keys);
  } else {
    const hn::Rebind<Key, D> narrow;
    return hn::PromoteTo(d, hn::LoadU(narrow, keys));
  }
}

template <typename Key, typename Rank, class D>
HWY_INLINE void rank_lines(D d, const Key* keys, int lines, int chunks,
                           const Ranking<Rank>& ranking, int line) {
  constexpr int kShift = 4 * sizeof(Rank);
  const auto zero = hn::Zero(d);
  const auto one = hn::Set(d, Rank{1});
  const auto chunk_length = hn::Set(d, static_cast<Rank>(kChunkPixels));
  const auto last = hn::Set(d, static_cast<Rank>(kLast));
  const auto high = hn::Set(d, static_cast<Rank>(~Rank{0} << kShift));
  // A key's value, in the upper half of the lane.
  const auto value_of = [&](auto key) HWY_ATTR {
    return hn::And(hn::ShiftLeft<kShift - 4 * static_cast<int>(sizeof(Key))>(key), high);
  };
  auto m1 = zero;
  auto m2 = zero;
  auto m3 = zero;
  auto m4 = zero;
  auto across = zero;
  auto number = hn::Set(d, static_cast<Rank>((Rank{1} << kShift) - 1));
  auto chunk_end = last;
  auto key = load_keys(d, keys + line);
  auto next_key = key;
  auto current = value_of(key);
  auto previous = zero;
  if (chunks > 1) previous = value_of(load_keys(d, keys + lines + line));
  for (int c = 0; c < chunks; ++c) {
    auto next = previous;
    if (c + 1 < chunks) {
      next_key = load_keys(d, keys + static_cast<std::ptrdiff_t>(c + 1) * lines + line);
      next = value_of(next_key);
    }
    const auto prominence = hn::Sub(current, hn::Min(current, hn::Min(previous, next)));
    const auto x1 = hn::Or(prominence, number);
    const auto x2 = hn::Min(m1, x1);
    const auto x3 = hn::Min(m2, x2);
    const auto x4 = hn::Min(m3, x3);
    const auto best = hn::Max(m1, x1);
    const auto here = hn::Sub(chunk_end, hn::And(key, last));
    across = hn::IfThenElse(hn::Eq(best, m1), across, here);
    m1 = best;
    m2 = hn::Max(m2, x2);
    m3 = hn::Max(m3, x3);
    m4 = hn::Max(m4, x4);
    previous = current;
    current = next;
    key = next_key;
    number = hn::Sub(number, one);
    chunk_end = hn::Add(chunk_end, chunk_length);
  }
  hn::StoreU(across, d, ranking.across + line);
  hn::StoreU(m1, d, ranking.best[0] + line);
  hn::StoreU(m2, d, ranking.best[1] + line);
  hn::StoreU(m3, d, ranking.best[2] + line);
  hn::StoreU(m4, d, ranking.best[3] + line);
}

template <typename Key, typename Rank>
void rank(const Key* keys, int lines, int chunks, const Ranking<Rank>& ranking) {
  const hn::ScalableTag<Rank> d;
  const hn::CappedTag<Rank, 1> one;
  const int n = static_cast<int>(hn::Lanes(d));
  int line = 0;
  for (; line + n <= lines; line += n) rank_lines(d, keys, lines, chunks, ranking, line);
  for (; line < lines; ++line) rank_lines(one, keys, lines, chunks, ranking, line);
}

void rank_u16(const std::uint16_t* keys, int lines, int chunks,
              const Ranking<std::uint16_t>& ranking) {
  rank(keys, lines, chunks, ranking);
}
void rank_u16_u32(const std::uint16_t* keys, int lines, int chunks,
                  const Ranking<std::uint32_t>& ranking) {
  rank(keys, lines, chunks, ranking);
}
void rank_u32(const std::uint32_t* keys, int lines, int chunks,
              const Ranking<std::uint32_t>& ranking) {
  rank(keys, lines, chunks, ranking);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(columns_u8);
HWY_EXPORT(columns_u16);
HWY_EXPORT(rows_u8);
HWY_EXPORT(rows_u16);
HWY_EXPORT(rank_u16);
HWY_EXPORT(rank_u16_u32);
HWY_EXPORT(rank_u32);

void chunk_maxima_of_columns(const PixelPlanes<std::uint8_t>& planes, std::uint16_t* keys) {
  HWY_DYNAMIC_DISPATCH(columns_u8)(planes, keys);
}
void chunk_maxima_of_columns(const PixelPlanes<std::uint16_t>& planes, std::uint32_t* keys) {
  HWY_DYNAMIC_DISPATCH(columns_u16)(planes, keys);
}
void chunk_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, std::uint16_t* keys) {
  HWY_DYNAMIC_DISPATCH(rows_u8)(planes, keys);
}
void chunk_maxima_of_rows(const PixelPlanes<std::uint16_t>& planes, std::uint32_t* keys) {
  HWY_DYNAMIC_DISPATCH(rows_u16)(planes, keys);
}
void rank_chunks(const std::uint16_t* keys, int lines, int chunks,
                 const Ranking<std::uint16_t>& ranking) {
  HWY_DYNAMIC_DISPATCH(rank_u16)(keys, lines, chunks, ranking);
}
void rank_chunks(const std::uint16_t* keys, int lines, int chunks,
                 const Ranking<std::uint32_t>& ranking) {
  HWY_DYNAMIC_DISPATCH(rank_u16_u32)(keys, lines, chunks, ranking);
}
void rank_chunks(const std::uint32_t* keys, int lines, int chunks,
                 const Ranking<std::uint32_t>& ranking) {
  HWY_DYNAMIC_DISPATCH(rank_u32)(keys, lines, chunks, ranking);
}

}  // namespace striper::detail
#endif  // HWY_ONCE
