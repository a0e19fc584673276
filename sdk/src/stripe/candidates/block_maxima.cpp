// SPDX-License-Identifier: Apache-2.0
#include "stripe/candidates/block_maxima.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "stripe/candidates/block_kernels.hpp"

namespace striper::detail {
namespace {

static_assert(BlockMaxima::kBlock == kBlockPixels);
static_assert(BlockMaxima::kBest == kBestBlocks);
static_assert(BlockMaxima::kFirst == kFirstBlocks);

constexpr int kMostNarrowBlocks = 256;

template <typename Pixel, typename Images>
PixelPlanes<Pixel> planes_of(const Images& images) {
  return {static_cast<const Pixel*>(images.lit),
          static_cast<const Pixel*>(images.dark),
          images.masked,
          images.lit_stride,
          images.dark_stride,
          images.masked_stride,
          images.rows,
          images.cols};
}

// Room for numbers, which OpenCV aligns to whole vectors.
template <typename Number>
Number* room(int rows, int cols, cv::Mat& numbers) {
  numbers.create(rows, cols, cv::traits::Type<Number>::value);
  return numbers.ptr<Number>();
}

// Whether a block's highest pixel is its border towards a peak next to it: the peak's own flank.
bool is_flank(std::int32_t across, std::int32_t peak, int reach) {
  constexpr int kBlock = BlockMaxima::kBlock;
  const bool is_above = across > peak && across % kBlock == 0;
  const bool is_below = across < peak && across % kBlock == kBlock - 1;
  return (is_above || is_below) && std::abs(across - peak) <= reach;
}

}  // namespace

BlockMaxima::Images BlockMaxima::images_of(const LitFrame& frame) {
  Images images;
  const auto take = [](const cv::Mat& image, const auto*& first, std::ptrdiff_t& stride) {
    if (image.empty()) return;
    first = image.data;
    stride = static_cast<std::ptrdiff_t>(image.step1());
  };
  take(frame.lit, images.lit, images.lit_stride);
  take(frame.dark, images.dark, images.dark_stride);
  take(frame.masked, images.masked, images.masked_stride);
  images.rows = frame.lit.rows;
  images.cols = frame.lit.cols;
  return images;
}

void BlockMaxima::find(const LitFrame& frame, StripeAxis axis) {
  const bool columns = axis == StripeAxis::kColumns;
  axis_ = axis;
  images_ = images_of(frame);
  lines_ = columns ? frame.lit.cols : frame.lit.rows;
  const int length = columns ? frame.lit.rows : frame.lit.cols;
  blocks_ = (length + kBlock - 1) / kBlock;
  if (frame.lit.depth() == CV_8U) {
    find_in<std::uint8_t>();
  } else {
    find_in<std::uint16_t>();
  }
  find_masked_lines(frame, axis);
}

template <typename Pixel>
void BlockMaxima::find_in() {
  Pixel* const maxima = room<Pixel>(blocks_, lines_, maxima_);
  if (axis_ == StripeAxis::kRows) {
    block_maxima_of_rows(planes_of<Pixel>(images_), maxima);
  } else {
    block_maxima_of_columns(planes_of<Pixel>(images_), maxima,
                            room<Pixel>(blocks_, lines_, positions_));
  }
}

void BlockMaxima::find_masked_lines(const LitFrame& frame, StripeAxis axis) {
  if (frame.masked.empty()) {
    masked_.clear();
    return;
  }
  masked_.assign(static_cast<std::size_t>(lines_), 0);
  for (int row = 0; row < frame.masked.rows; ++row) {
    const auto* const mask = frame.masked.ptr<std::uint8_t>(row);
    if (axis == StripeAxis::kColumns) {
      for (std::size_t col = 0; col < masked_.size(); ++col) masked_[col] |= mask[col];
    } else {
      std::uint8_t any = 0;
      for (int col = 0; col < frame.masked.cols; ++col) any |= mask[col];
      masked_[static_cast<std::size_t>(row)] = any;
    }
  }
}

void BlockMaxima::rank(int depth) {
  depth_ = depth <= kFirst ? kFirst : kBest;
  if (maxima_.depth() == CV_16U) {
    rank_in<std::uint16_t, std::uint16_t>();
  } else if (blocks_ > kMostNarrowBlocks) {
    rank_in<std::uint8_t, std::uint16_t>();
  } else {
    rank_in<std::uint8_t, std::uint8_t>();
  }
}

template <typename Pixel, typename Rank>
void BlockMaxima::rank_in() {
  Blocks<Pixel> blocks{maxima_.ptr<Pixel>(0), nullptr, lines_, blocks_};
  if (axis_ == StripeAxis::kColumns) blocks.positions = positions_.ptr<Pixel>(0);
  best_across_.resize(static_cast<std::size_t>(lines_));
  rank_blocks(blocks, Ranking<Rank>{depth_, room<Rank>(kBest, lines_, prominences_),
                                    room<Rank>(kBest, lines_, best_blocks_), best_across_.data()});
  // The ranking tells which block of a row; the maximum is somewhere in it.
  if (axis_ == StripeAxis::kRows) move_in_rows<Pixel>(0, lines_, best_across_.data());
}

void BlockMaxima::find_rivals(const RivalLimits& limits, Rivals& rivals) {
  const auto lines = static_cast<std::size_t>(lines_);
  rivals.places.clear();
  rivals.places.reserve(lines * (kBest - 1));
  for (auto* some : {&rivals.weak_lines, &rivals.flat_lines}) {
    some->clear();
    some->reserve(lines);
  }
  if (prominences_.depth() == CV_16U) {
    find_rivals_in<std::uint16_t>(limits, rivals);
  } else {
    find_rivals_in<std::uint8_t>(limits, rivals);
  }
}

template <typename Rank>
void BlockMaxima::find_rivals_in(const RivalLimits& limits, Rivals& rivals) {
  const auto rank_of = [](int dn) {
    return static_cast<Rank>(std::min<int>(dn, std::numeric_limits<Rank>::max()));
  };
  // At most as prominent as is weak, at least as a second: limits beyond the ranks stop there.
  const auto may_be_unclear =
      [weak = rank_of(limits.weak_dn - 1), second = rank_of(limits.second_dn),
       firsts = prominences_.ptr<Rank>(0), seconds = prominences_.ptr<Rank>(1)](int line) -> Rank {
    return static_cast<Rank>((firsts[line] <= weak) | (seconds[line] >= second));
  };
  // Without branches: nearly always the answer is no, a vector at a time.
  constexpr int kTogether = 16;
  for (int first = 0; first < lines_; first += kTogether) {
    const int last = std::min(first + kTogether, lines_);
    Rank any = 0;
    for (int line = first; line < last; ++line) any |= may_be_unclear(line);
    if (any == 0) continue;
    for (int line = first; line < last; ++line) find_rivals_of(line, limits, rivals);
  }
}

void BlockMaxima::find_rivals_of(int line, const RivalLimits& limits, Rivals& rivals) {
  const int first_dn = prominence_dn(0, line);
  if (first_dn < limits.weak_dn) {
    (first_dn == 0 ? rivals.flat_lines : rivals.weak_lines).push_back(line);
    return;
  }
  const std::int32_t first_across = best_across_[static_cast<std::size_t>(line)];
  for (int n = 1; n < kBest && prominence_dn(n, line) >= limits.second_dn; ++n) {
    if (n == depth_) rank();
    const int across = at(number_at(best_blocks_, n, line), line).across;
    if (!is_flank(across, first_across, limits.flank_px)) rivals.places.push_back({line, across});
  }
}

template <typename Pixel>
void BlockMaxima::move_in_rows(int first_line, int count, std::int32_t* across) const noexcept {
  move_to_maxima_of_rows(planes_of<Pixel>(images_), maxima_.ptr<Pixel>(0), first_line, count,
                         across);
}

int BlockMaxima::across_in_row(int block, int line) const noexcept {
  std::int32_t across = block * kBlock;
  if (maxima_.depth() == CV_16U) {
    move_in_rows<std::uint16_t>(line, 1, &across);
  } else {
    move_in_rows<std::uint8_t>(line, 1, &across);
  }
  return across;
}

}  // namespace striper::detail
