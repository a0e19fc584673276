// SPDX-License-Identifier: Apache-2.0
#include "ambient/pixels/interlaced_picture.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

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

// Squared differences along rows or columns: to the next pixel, and to the next but one.
struct Differences {
  double of_next = 0.0;
  double of_next_but_one = 0.0;
  double pixels = 0.0;

  void add(int here, int next, int next_but_one) {
    of_next += static_cast<double>(here - next) * (here - next);
    of_next_but_one += static_cast<double>(here - next_but_one) * (here - next_but_one);
    pixels += 1.0;
  }
  bool are_combed() const { return of_next > kCombed * of_next_but_one + kRounding * pixels; }
};

template <typename Pixel>
bool is_interlaced(const cv::Mat& image, int top, int left) {
  const int channels = image.channels();
  const auto below = static_cast<std::ptrdiff_t>(image.step1());
  Differences down;
  Differences across;
  for (int row = top; row < top + kBlock; ++row) {
    const auto* const pixels = image.ptr<Pixel>(row) + left * channels;
    for (int i = 0; i < kBlock; ++i) {
      const auto* const p = pixels + i * channels;
      down.add(p[0], p[below], p[2 * below]);
      across.add(p[0], p[channels], p[2 * channels]);
    }
  }
  return down.are_combed() && !across.are_combed();
}

template <typename Pixel>
bool has_interlaced_blocks(const cv::Mat& image) {
  int blocks = 0;
  int interlaced = 0;
  for (int top = 0; top + kBlock + 2 <= image.rows; top += kBlock) {
    for (int left = 0; left + kBlock + 2 <= image.cols; left += kBlock) {
      ++blocks;
      if (is_interlaced<Pixel>(image, top, left)) ++interlaced;
    }
  }
  return interlaced >= std::max(kLeastBlocks, static_cast<int>(kLeastPart * blocks));
}

}  // namespace

bool looks_interlaced(const cv::Mat& image) {
  return image.depth() == CV_8U ? has_interlaced_blocks<std::uint8_t>(image)
                                : has_interlaced_blocks<std::uint16_t>(image);
}

}  // namespace striper::detail
