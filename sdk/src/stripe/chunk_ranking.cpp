// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
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
  const auto last = hn::Set(d, static_cast<Rank>(kChunkPixels - 1));
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
