// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "bench/read_roofline.hpp"

#include <cstddef>
#include <cstring>
#include <numeric>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/read_roofline.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::speed {
namespace HWY_NAMESPACE {
namespace {

#if HWY_TARGET == HWY_SCALAR
// A vector holds one number there: as the compiler pleases.
std::uint64_t words(const std::uint8_t* bytes, std::size_t count) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i + sizeof(sum) <= count; i += sizeof(sum)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes + i, sizeof(word));
    sum += word;
  }
  return sum;
}

std::uint64_t bytes(const std::uint8_t* bytes, std::size_t count) {
  return std::accumulate(bytes, bytes + count, std::uint64_t{0});
}
#else
namespace hn = hwy::HWY_NAMESPACE;
using Words = hn::ScalableTag<std::uint64_t>;
using Bytes = hn::Repartition<std::uint8_t, Words>;

// The sum of `words_of(vector of bytes)`, but for bytes beyond the last whole vectors.
template <class WordsOf>
HWY_INLINE std::uint64_t sum_of(const std::uint8_t* bytes, std::size_t count, WordsOf words_of) {
  constexpr int kTogether = 4;  // So that no sum waits for itself.
  const Words words;
  const Bytes d;
  const std::size_t n = hn::Lanes(d);
  hn::Vec<Words> sums[kTogether];
  for (auto& sum : sums) sum = hn::Zero(words);
  for (std::size_t i = 0; i + kTogether * n <= count; i += kTogether * n) {
    for (int k = 0; k < kTogether; ++k) {
      sums[k] = hn::Add(sums[k], words_of(hn::LoadU(d, bytes + i + k * n)));
    }
  }
  const auto sum = hn::Add(hn::Add(sums[0], sums[1]), hn::Add(sums[2], sums[3]));
  // By hand: AVX-512's own sum of lanes is one of signed numbers, which must not wrap.
  HWY_ALIGN std::uint64_t lanes[hn::MaxLanes(Words())];
  hn::Store(sum, words, lanes);
  return std::accumulate(lanes, lanes + hn::Lanes(words), std::uint64_t{0});
}

std::uint64_t words(const std::uint8_t* bytes, std::size_t count) {
  return sum_of(bytes, count, [](auto v) HWY_ATTR { return hn::BitCast(Words(), v); });
}

std::uint64_t bytes(const std::uint8_t* bytes, std::size_t count) {
  return sum_of(bytes, count, [](auto v) HWY_ATTR { return hn::SumsOf8(v); });
}
#endif

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::speed
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::speed {

HWY_EXPORT(words);
HWY_EXPORT(bytes);

std::uint64_t sum_of_words(const cv::Mat& image) {
  return HWY_DYNAMIC_DISPATCH(words)(image.data, image.total() * image.elemSize());
}

std::uint64_t sum_of_bytes(const cv::Mat& image) {
  return HWY_DYNAMIC_DISPATCH(bytes)(image.data, image.total() * image.elemSize());
}

}  // namespace striper::speed
#endif  // HWY_ONCE
