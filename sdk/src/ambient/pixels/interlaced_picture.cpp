// SPDX-License-Identifier: Apache-2.0
#include "ambient/pixels/interlaced_picture.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace striper::detail {
namespace {

constexpr int kBlock = 16;
// Noise alone makes more than this of one block in a thousand,
constexpr double kCombed = 1.6;
// and rounding alone this much, DN^2 a pixel.
constexpr double kRounding = 1.0;
// So many blocks, and this part of them, are no chance.
constexpr int kLeastBlocks = 6;
constexpr double kLeastPart = 0.01;

// Sums of squared differences of a block's pixels, to the next one and to the next but one.
struct Differences {
  double of_next;
  double of_next_but_one;

  bool are_combed() const {
    return of_next > kCombed * of_next_but_one + kRounding * kBlock * kBlock;
  }
};

// @param first of the block. @param step from a pixel to the next one, in elements.
template <typename Pixel, int kChannels>
Differences differences(const Pixel* first, std::ptrdiff_t row_step, std::ptrdiff_t step) {
  // 256 squares of 8 bits fit into 32 bits, which the compiler makes vectors of.
  using Sum = std::conditional_t<sizeof(Pixel) == 1, std::int32_t, std::int64_t>;
  Sum of_next = 0;
  Sum of_next_but_one = 0;
  for (int row = 0; row < kBlock; ++row) {
    const Pixel* const here = first + row * row_step;
    const Pixel* const next = here + step;
    const Pixel* const next_but_one = next + step;
    for (int i = 0; i < kBlock * kChannels; i += kChannels) {
      const Sum near = here[i] - next[i];
      const Sum far = here[i] - next_but_one[i];
      of_next += near * near;
      of_next_but_one += far * far;
    }
  }
  return {static_cast<double>(of_next), static_cast<double>(of_next_but_one)};
}

template <typename Pixel, int kChannels>
bool is_interlaced(const cv::Mat& image, int top, int left) {
  const auto* const first = image.ptr<Pixel>(top) + left * kChannels;
  const auto below = static_cast<std::ptrdiff_t>(image.step1());
  return differences<Pixel, kChannels>(first, below, below).are_combed() &&
         !differences<Pixel, kChannels>(first, below, kChannels).are_combed();
}

template <typename Pixel, int kChannels>
bool has_interlaced_blocks(const cv::Mat& image) {
  int blocks = 0;
  int interlaced = 0;
  for (int top = 0; top + kBlock + 2 <= image.rows; top += kBlock) {
    for (int left = 0; left + kBlock + 2 <= image.cols; left += kBlock) {
      ++blocks;
      if (is_interlaced<Pixel, kChannels>(image, top, left)) ++interlaced;
    }
  }
  return interlaced >= std::max(kLeastBlocks, static_cast<int>(kLeastPart * blocks));
}

template <typename Pixel>
bool looks_interlaced_as(const cv::Mat& image) {
  if (image.channels() == 1) return has_interlaced_blocks<Pixel, 1>(image);
  return image.channels() == 3 && has_interlaced_blocks<Pixel, 3>(image);
}

}  // namespace

bool looks_interlaced(const cv::Mat& image) {
  return image.depth() == CV_8U ? looks_interlaced_as<std::uint8_t>(image)
                                : looks_interlaced_as<std::uint16_t>(image);
}

}  // namespace striper::detail
