// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <striper/stripe/candidates.hpp>

#include "stripe/chunk_kernels.hpp"

namespace striper {
namespace {

static_assert(ChunkMaxima::kChunk == detail::kChunkPixels);
static_assert(ChunkMaxima::kBest == detail::kBestChunks);

constexpr int kMostNarrowChunks = 256;

template <typename Pixel>
detail::PixelPlanes<Pixel> planes_of(const LitFrame& frame) {
  detail::PixelPlanes<Pixel> planes;
  planes.lit = frame.lit.ptr<Pixel>();
  planes.lit_stride = static_cast<std::ptrdiff_t>(frame.lit.step1());
  if (!frame.dark.empty()) {
    planes.dark = frame.dark.ptr<Pixel>();
    planes.dark_stride = static_cast<std::ptrdiff_t>(frame.dark.step1());
  }
  if (!frame.blind.empty()) {
    planes.blind = frame.blind.ptr<std::uint8_t>();
    planes.blind_stride = static_cast<std::ptrdiff_t>(frame.blind.step1());
  }
  planes.rows = frame.lit.rows;
  planes.cols = frame.lit.cols;
  return planes;
}

template <typename Pixel, typename Key>
void find_chunks(const LitFrame& frame, StripeAxis axis, std::vector<Key>& keys) {
  if (axis == StripeAxis::kColumns) {
    detail::chunk_maxima_of_columns(planes_of<Pixel>(frame), keys.data());
  } else {
    detail::chunk_maxima_of_rows(planes_of<Pixel>(frame), keys.data());
  }
}

template <typename Key, typename Rank>
void rank_into(const std::vector<Key>& keys, int lines, int chunks,
               std::array<std::vector<Rank>, ChunkMaxima::kBest>& best) {
  std::array<Rank*, ChunkMaxima::kBest> ranks{};
  for (std::size_t n = 0; n < best.size(); ++n) {
    best[n].resize(static_cast<std::size_t>(lines));
    ranks[n] = best[n].data();
  }
  detail::rank_chunks(keys.data(), lines, chunks, ranks);
}

}  // namespace

void ChunkMaxima::find(const LitFrame& frame, StripeAxis axis) {
  const bool columns = axis == StripeAxis::kColumns;
  lines_ = columns ? frame.lit.cols : frame.lit.rows;
  const int length = columns ? frame.lit.rows : frame.lit.cols;
  chunks_ = (length + kChunk - 1) / kChunk;
  has_wide_keys_ = frame.lit.depth() != CV_8U;
  const std::size_t count = static_cast<std::size_t>(lines_) * static_cast<std::size_t>(chunks_);
  if (has_wide_keys_) {
    keys16_.resize(count);
    find_chunks<std::uint16_t>(frame, axis, keys16_);
  } else {
    keys8_.resize(count);
    find_chunks<std::uint8_t>(frame, axis, keys8_);
  }
  find_blind_lines(frame, axis);
}

void ChunkMaxima::find_blind_lines(const LitFrame& frame, StripeAxis axis) {
  if (frame.blind.empty()) {
    blind_.clear();
    return;
  }
  blind_.assign(static_cast<std::size_t>(lines_), 0);
  for (int row = 0; row < frame.blind.rows; ++row) {
    const auto* const mask = frame.blind.ptr<std::uint8_t>(row);
    if (axis == StripeAxis::kColumns) {
      for (std::size_t col = 0; col < blind_.size(); ++col) blind_[col] |= mask[col];
    } else {
      std::uint8_t any = 0;
      for (int col = 0; col < frame.blind.cols; ++col) any |= mask[col];
      blind_[static_cast<std::size_t>(row)] = any;
    }
  }
}

void ChunkMaxima::best_across(std::int32_t* across) const noexcept {
  const auto find = [&](const auto& keys, const auto& ranks) {
    constexpr unsigned kLowMask = (1U << (4 * sizeof(ranks[0]))) - 1;
    for (std::size_t line = 0; line < ranks.size(); ++line) {
      const std::size_t chunk = ranks[line] == 0 ? 0 : kLowMask - (ranks[line] & kLowMask);
      const auto key = static_cast<int>(keys[chunk * ranks.size() + line] & (kChunk - 1));
      across[line] = ranks[line] == 0 ? 0 : static_cast<int>(chunk) * kChunk + kChunk - 1 - key;
    }
  };
  if (has_wide_keys_) {
    find(keys16_, best16_[0]);
  } else if (is_wide_) {
    find(keys8_, best16_[0]);
  } else {
    find(keys8_, best8_[0]);
  }
}

void ChunkMaxima::rank() {
  is_wide_ = has_wide_keys_ || chunks_ > kMostNarrowChunks;
  if (has_wide_keys_) {
    rank_into(keys16_, lines_, chunks_, best16_);
  } else if (is_wide_) {
    rank_into(keys8_, lines_, chunks_, best16_);
  } else {
    rank_into(keys8_, lines_, chunks_, best8_);
  }
}

}  // namespace striper
