// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "stripe/chunk_kernels.hpp"

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/chunk_ranking.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kChunkBits = 5;
static_assert(1 << kChunkBits == kChunkPixels);

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

// Lines side by side, chunk after chunk: the most prominent ones so far, best first.
template <class D>
struct Best {
  using Rank = hn::TFromD<D>;
  using Signed = hn::RebindToSigned<D>;
  static constexpr int kShift = 4 * sizeof(Rank);
  // Turns ranks into signed numbers of the same order, which every instruction set compares at
  // once.
  static constexpr Rank kSign = Rank{1} << (2 * kShift - 1);

  hn::Vec<Signed> ranks[kBestChunks];
  hn::Vec<D> first_key;  // Of the first of them.
  // Of chunks: keys, and their values in the upper half of the lane.
  hn::Vec<D> key, value, value_before;

  // How far a chunk rises above the darker one of its neighbours.
  HWY_INLINE hn::Vec<D> prominence(hn::Vec<D> value_after) const {
    const auto darker = hn::Min(value_before, value_after);
    if constexpr (sizeof(Rank) == 2) {
      return hn::SaturatedSub(value, darker);
    } else {
      return hn::Sub(hn::Max(value, darker), darker);
    }
  }

  HWY_INLINE void add(hn::Vec<Signed> rank) {
    const auto is_first = hn::Gt(rank, ranks[0]);
    first_key = hn::IfThenElse(hn::RebindMask(D(), is_first), key, first_key);
    const auto second = hn::IfThenElse(is_first, ranks[0], rank);
    ranks[0] = hn::IfThenElse(is_first, rank, ranks[0]);
    rank = second;
    for (int n = 1; n < kBestChunks; ++n) {
      const auto lower = hn::Min(ranks[n], rank);
      ranks[n] = hn::Max(ranks[n], rank);
      rank = lower;
    }
  }

  HWY_INLINE void store(D d, const Ranking<Rank>& ranking, int line) const {
    const auto rank = [&](int n)
                          HWY_ATTR { return hn::Xor(hn::BitCast(d, ranks[n]), hn::Set(d, kSign)); };
    const auto last_chunk = hn::Set(d, static_cast<Rank>((Rank{1} << kShift) - 1));
    const auto last_pixel = hn::Set(d, static_cast<Rank>(kChunkPixels - 1));
    const auto chunk = hn::Sub(last_chunk, hn::And(rank(0), last_chunk));
    const auto pixel = hn::Sub(last_pixel, hn::And(first_key, last_pixel));
    hn::StoreU(hn::Add(hn::ShiftLeft<kChunkBits>(chunk), pixel), d, ranking.across + line);
    for (int n = 0; n < kBestChunks; ++n) hn::StoreU(rank(n), d, ranking.best[n] + line);
  }
};

// So many vectors of lines side by side.
template <int kVectors, typename Key, typename Rank, class D>
HWY_INLINE void rank_lines(D d, const Key* keys, int lines, int chunks,
                           const Ranking<Rank>& ranking, int line) {
  constexpr int kShift = Best<D>::kShift;
  const int n = static_cast<int>(hn::Lanes(d));
  const typename Best<D>::Signed ds;
  const auto zero = hn::Zero(d);
  const auto high = hn::Set(d, static_cast<Rank>(~Rank{0} << kShift));
  const auto value_of = [&](auto key) HWY_ATTR {
    return hn::And(hn::ShiftLeft<kShift - 4 * static_cast<int>(sizeof(Key))>(key), high);
  };
  const std::ptrdiff_t last = chunks - 1;
  Best<D> best[kVectors];
  for (int v = 0; v < kVectors; ++v) {
    Best<D>& b = best[v];
    for (auto& rank : b.ranks) rank = hn::BitCast(ds, hn::Set(d, Best<D>::kSign));
    b.first_key = zero;
    b.key = load_keys(d, keys + line + v * n);
    b.value = value_of(b.key);
    // The first and the last chunk of a line have one neighbour only, and an only one none.
    b.value_before = last > 0 ? value_of(load_keys(d, keys + lines + line + v * n)) : zero;
  }
  auto number = hn::Set(d, static_cast<Rank>(Best<D>::kSign | ((Rank{1} << kShift) - 1)));
  for (std::ptrdiff_t c = 0; c <= last; ++c) {
    const Key* const next = keys + std::min(c + 1, last) * lines + line;
    for (int v = 0; v < kVectors; ++v) {
      Best<D>& b = best[v];
      const auto key = load_keys(d, next + v * n);
      const auto value = c < last ? value_of(key) : b.value_before;
      b.add(hn::BitCast(ds, hn::Xor(b.prominence(value), number)));
      b.value_before = b.value;
      b.value = value;
      b.key = key;
    }
    number = hn::Sub(number, hn::Set(d, Rank{1}));
  }
  for (int v = 0; v < kVectors; ++v) best[v].store(d, ranking, line + v * n);
}

template <typename Key, typename Rank>
void rank(const Key* keys, int lines, int chunks, const Ranking<Rank>& ranking) {
  constexpr int kTogether = 2;
  const hn::ScalableTag<Rank> d;
  const hn::CappedTag<Rank, 1> one;
  const int n = static_cast<int>(hn::Lanes(d));
  int line = 0;
  for (; line + kTogether * n <= lines; line += kTogether * n) {
    rank_lines<kTogether>(d, keys, lines, chunks, ranking, line);
  }
  for (; line + n <= lines; line += n) rank_lines<1>(d, keys, lines, chunks, ranking, line);
  for (; line < lines; ++line) rank_lines<1>(one, keys, lines, chunks, ranking, line);
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

HWY_EXPORT(rank_u16);
HWY_EXPORT(rank_u16_u32);
HWY_EXPORT(rank_u32);

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
