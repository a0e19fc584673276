// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "stripe/candidates/chunk_kernels.hpp"

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/candidates/chunk_ranking.cpp"
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

// Numbers in lanes as wide or wider.
template <class D, typename Number>
HWY_INLINE hn::Vec<D> load(D d, const Number* numbers) {
  if constexpr (sizeof(Number) == sizeof(hn::TFromD<D>)) {
    return hn::LoadU(d, numbers);
  } else {
    const hn::Rebind<Number, D> narrow;
    return hn::PromoteTo(d, hn::LoadU(narrow, numbers));
  }
}

// Lines side by side, chunk after chunk: the most prominent ones so far, best first.
template <int kDepth, class D>
struct Best {
  using Rank = hn::TFromD<D>;
  // Of the first one that has no number any more it is known how far it rises.
  static constexpr int kRises = std::min(kDepth + 1, kBestChunks);

  hn::Vec<D> prominence[kRises];
  hn::Vec<D> chunk[kDepth];
  hn::Vec<D> position;  // Of the maximum of the first of them.

  // Behind what rises as much.
  HWY_INLINE void add(hn::Vec<D> rise, hn::Vec<D> number, hn::Vec<D> place) {
    for (int n = kRises - 1; n > 0; --n) {
      const auto pushes = hn::Gt(rise, prominence[n - 1]);
      if (n < kDepth) {
        const auto own = hn::IfThenElse(hn::Gt(rise, prominence[n]), number, chunk[n]);
        chunk[n] = hn::IfThenElse(pushes, chunk[n - 1], own);
      }
      prominence[n] = hn::IfThenElse(pushes, prominence[n - 1], hn::Max(prominence[n], rise));
    }
    const auto is_first = hn::Gt(rise, prominence[0]);
    chunk[0] = hn::IfThenElse(is_first, number, chunk[0]);
    position = hn::IfThenElse(is_first, place, position);
    prominence[0] = hn::Max(prominence[0], rise);
  }

  HWY_INLINE void store(D d, const Ranking<Rank>& ranking, std::ptrdiff_t lines, int line) const {
    for (int n = 0; n < kRises; ++n) {
      hn::StoreU(prominence[n], d, ranking.prominence + n * lines + line);
    }
    for (int n = 0; n < kDepth; ++n) hn::StoreU(chunk[n], d, ranking.chunk + n * lines + line);
    HWY_ALIGN Rank positions[hn::MaxLanes(D())];
    hn::Store(position, d, positions);
    const hn::CappedTag<std::int32_t, hn::MaxLanes(D())> wide;
    for (std::size_t i = 0; i < hn::Lanes(d); i += hn::Lanes(wide)) {
      const auto first = hn::ShiftLeft<kChunkBits>(load(wide, ranking.chunk + line + i));
      hn::StoreU(hn::Add(first, load(wide, positions + i)), wide, ranking.across + line + i);
    }
  }
};

// A vector of lines.
template <int kDepth, typename Pixel, typename Rank, class D>
HWY_INLINE void rank_lines(D d, const Chunks<Pixel>& chunks, const Ranking<Rank>& ranking,
                           int line) {
  const auto zero = hn::Zero(d);
  const std::ptrdiff_t last = chunks.count - 1;
  const auto of_chunk = [&](const Pixel* numbers, std::ptrdiff_t c)
                            HWY_ATTR { return load(d, numbers + c * chunks.lines + line); };
  const auto position = [&](std::ptrdiff_t c) HWY_ATTR {
    return chunks.positions != nullptr ? of_chunk(chunks.positions, c) : zero;
  };
  Best<kDepth, D> best;
  for (auto& prominence : best.prominence) prominence = zero;
  for (auto& chunk : best.chunk) chunk = zero;
  best.position = position(0);
  auto value = of_chunk(chunks.maxima, 0);
  // The first and the last chunk of a line have one neighbour only, and an only one none.
  auto before = last > 0 ? of_chunk(chunks.maxima, 1) : zero;
  auto number = zero;
  for (std::ptrdiff_t c = 0; c <= last; ++c) {
    const auto after = c < last ? of_chunk(chunks.maxima, c + 1) : before;
    // How far it rises above the darker one of its neighbours.
    best.add(hn::SaturatedSub(value, hn::Min(before, after)), number, position(c));
    before = value;
    value = after;
    number = hn::Add(number, hn::Set(d, Rank{1}));
  }
  best.store(d, ranking, chunks.lines, line);
}

template <int kDepth, typename Pixel, typename Rank>
void rank_to(const Chunks<Pixel>& chunks, const Ranking<Rank>& ranking) {
  const hn::ScalableTag<Rank> d;
  const hn::CappedTag<Rank, 1> one;
  const int n = static_cast<int>(hn::Lanes(d));
  if (chunks.lines < n) {
    for (int line = 0; line < chunks.lines; ++line) rank_lines<kDepth>(one, chunks, ranking, line);
    return;
  }
  // The last lines may overlap those before them: the same is written twice.
  for (int line = 0; line < chunks.lines; line += n) {
    rank_lines<kDepth>(d, chunks, ranking, std::min(line, chunks.lines - n));
  }
}

template <typename Pixel, typename Rank>
void rank(const Chunks<Pixel>& chunks, const Ranking<Rank>& ranking) {
  if (ranking.depth == kFirstChunks) {
    rank_to<kFirstChunks>(chunks, ranking);
  } else {
    rank_to<kBestChunks>(chunks, ranking);
  }
}

void rank_u8(const Chunks<std::uint8_t>& chunks, const Ranking<std::uint8_t>& ranking) {
  rank(chunks, ranking);
}
void rank_u8_u16(const Chunks<std::uint8_t>& chunks, const Ranking<std::uint16_t>& ranking) {
  rank(chunks, ranking);
}
void rank_u16(const Chunks<std::uint16_t>& chunks, const Ranking<std::uint16_t>& ranking) {
  rank(chunks, ranking);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(rank_u8);
HWY_EXPORT(rank_u8_u16);
HWY_EXPORT(rank_u16);

void rank_chunks(const Chunks<std::uint8_t>& chunks, const Ranking<std::uint8_t>& ranking) {
  HWY_DYNAMIC_DISPATCH(rank_u8)(chunks, ranking);
}
void rank_chunks(const Chunks<std::uint8_t>& chunks, const Ranking<std::uint16_t>& ranking) {
  HWY_DYNAMIC_DISPATCH(rank_u8_u16)(chunks, ranking);
}
void rank_chunks(const Chunks<std::uint16_t>& chunks, const Ranking<std::uint16_t>& ranking) {
  HWY_DYNAMIC_DISPATCH(rank_u16)(chunks, ranking);
}

}  // namespace striper::detail
#endif  // HWY_ONCE
