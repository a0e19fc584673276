// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "stripe/candidates/block_kernels.hpp"

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/candidates/block_ranking.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kBlockBits = 5;
static_assert(1 << kBlockBits == kBlockPixels);

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

// Scan lines side by side, block after block: the most prominent ones so far, best first.
template <int kDepth, class D>
struct Best {
  using Rank = hn::TFromD<D>;
  // Of the first one that has no number any more it is known how far it rises.
  static constexpr int kRises = std::min(kDepth + 1, kBestBlocks);

  hn::Vec<D> prominence[kRises];
  hn::Vec<D> block[kDepth];
  hn::Vec<D> position;  // Of the maximum of the first of them.

  // Behind what rises as much.
  HWY_INLINE void add(hn::Vec<D> rise, hn::Vec<D> number, hn::Vec<D> place) {
    for (int n = kRises - 1; n > 0; --n) {
      const auto pushes = hn::Gt(rise, prominence[n - 1]);
      if (n < kDepth) {
        const auto own = hn::IfThenElse(hn::Gt(rise, prominence[n]), number, block[n]);
        block[n] = hn::IfThenElse(pushes, block[n - 1], own);
      }
      prominence[n] = hn::IfThenElse(pushes, prominence[n - 1], hn::Max(prominence[n], rise));
    }
    const auto is_first = hn::Gt(rise, prominence[0]);
    block[0] = hn::IfThenElse(is_first, number, block[0]);
    position = hn::IfThenElse(is_first, place, position);
    prominence[0] = hn::Max(prominence[0], rise);
  }

  HWY_INLINE void store(D d, const Ranking<Rank>& ranking, std::ptrdiff_t lines, int line) const {
    for (int n = 0; n < kRises; ++n) {
      hn::StoreU(prominence[n], d, ranking.prominence + n * lines + line);
    }
    for (int n = 0; n < kDepth; ++n) hn::StoreU(block[n], d, ranking.block + n * lines + line);
    HWY_ALIGN Rank positions[hn::MaxLanes(D())];
    hn::Store(position, d, positions);
    const hn::CappedTag<std::int32_t, hn::MaxLanes(D())> wide;
    for (std::size_t i = 0; i < hn::Lanes(d); i += hn::Lanes(wide)) {
      const auto first = hn::ShiftLeft<kBlockBits>(load(wide, ranking.block + line + i));
      hn::StoreU(hn::Add(first, load(wide, positions + i)), wide, ranking.across + line + i);
    }
  }
};

// A vector of scan lines.
template <int kDepth, typename Pixel, typename Rank, class D>
HWY_INLINE void rank_lines(D d, const Blocks<Pixel>& blocks, const Ranking<Rank>& ranking,
                           int line) {
  const auto zero = hn::Zero(d);
  const std::ptrdiff_t last = blocks.count - 1;
  const auto of_block = [&](const Pixel* numbers, std::ptrdiff_t c)
                            HWY_ATTR { return load(d, numbers + c * blocks.lines + line); };
  const auto position = [&](std::ptrdiff_t c) HWY_ATTR {
    return blocks.positions != nullptr ? of_block(blocks.positions, c) : zero;
  };
  Best<kDepth, D> best;
  for (auto& prominence : best.prominence) prominence = zero;
  for (auto& block : best.block) block = zero;
  best.position = position(0);
  auto value = of_block(blocks.maxima, 0);
  // The first and the last block of a scan line have one neighbour only, and an only one none.
  auto before = last > 0 ? of_block(blocks.maxima, 1) : zero;
  auto number = zero;
  for (std::ptrdiff_t c = 0; c <= last; ++c) {
    const auto after = c < last ? of_block(blocks.maxima, c + 1) : before;
    // How far it rises above the darker one of its neighbours.
    best.add(hn::SaturatedSub(value, hn::Min(before, after)), number, position(c));
    before = value;
    value = after;
    number = hn::Add(number, hn::Set(d, Rank{1}));
  }
  best.store(d, ranking, blocks.lines, line);
}

template <int kDepth, typename Pixel, typename Rank>
void rank_to(const Blocks<Pixel>& blocks, const Ranking<Rank>& ranking) {
  const hn::ScalableTag<Rank> d;
  const hn::CappedTag<Rank, 1> one;
  const int n = static_cast<int>(hn::Lanes(d));
  if (blocks.lines < n) {
    for (int line = 0; line < blocks.lines; ++line) rank_lines<kDepth>(one, blocks, ranking, line);
    return;
  }
  // The last scan lines may overlap those before them: the same is written twice.
  for (int line = 0; line < blocks.lines; line += n) {
    rank_lines<kDepth>(d, blocks, ranking, std::min(line, blocks.lines - n));
  }
}

template <typename Pixel, typename Rank>
void rank(const Blocks<Pixel>& blocks, const Ranking<Rank>& ranking) {
  if (ranking.depth == kFirstBlocks) {
    rank_to<kFirstBlocks>(blocks, ranking);
  } else {
    rank_to<kBestBlocks>(blocks, ranking);
  }
}

void rank_u8(const Blocks<std::uint8_t>& blocks, const Ranking<std::uint8_t>& ranking) {
  rank(blocks, ranking);
}
void rank_u8_u16(const Blocks<std::uint8_t>& blocks, const Ranking<std::uint16_t>& ranking) {
  rank(blocks, ranking);
}
void rank_u16(const Blocks<std::uint16_t>& blocks, const Ranking<std::uint16_t>& ranking) {
  rank(blocks, ranking);
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

void rank_blocks(const Blocks<std::uint8_t>& blocks, const Ranking<std::uint8_t>& ranking) {
  HWY_DYNAMIC_DISPATCH(rank_u8)(blocks, ranking);
}
void rank_blocks(const Blocks<std::uint8_t>& blocks, const Ranking<std::uint16_t>& ranking) {
  HWY_DYNAMIC_DISPATCH(rank_u8_u16)(blocks, ranking);
}
void rank_blocks(const Blocks<std::uint16_t>& blocks, const Ranking<std::uint16_t>& ranking) {
  HWY_DYNAMIC_DISPATCH(rank_u16)(blocks, ranking);
}

}  // namespace striper::detail
#endif  // HWY_ONCE
