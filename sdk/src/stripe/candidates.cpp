// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <limits>

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
               std::array<std::vector<Rank>, ChunkMaxima::kBest>& best, std::vector<Rank>& across) {
  const auto count = static_cast<std::size_t>(lines);
  detail::Ranking<Rank> ranking;
  for (std::size_t n = 0; n < best.size(); ++n) {
    best[n].resize(count);
    ranking.best[n] = best[n].data();
  }
  across.resize(count);
  ranking.across = across.data();
  detail::rank_chunks(keys.data(), lines, chunks, ranking);
}

// Whether a chunk's highest pixel is its border towards a peak next to it: the peak's own flank.
bool is_flank(std::int32_t across, std::int32_t peak, int reach) {
  constexpr int kChunk = ChunkMaxima::kChunk;
  const bool is_above = across > peak && across % kChunk == 0;
  const bool is_below = across < peak && across % kChunk == kChunk - 1;
  return (is_above || is_below) && std::abs(across - peak) <= reach;
}

template <typename Rank>
void find_rivals_in(const ChunkMaxima& chunks,
                    const std::array<std::vector<Rank>, ChunkMaxima::kBest>& best,
                    const std::vector<Rank>& best_across, const ChunkMaxima::RivalLimits& limits,
                    ChunkMaxima::Rivals& rivals) {
  constexpr int kShift = 4 * sizeof(Rank);
  constexpr Rank kHighest = std::numeric_limits<Rank>::max();
  constexpr Rank kChunkBits = kHighest >> kShift;
  const auto least_rank = [](int dn) {
    const std::uint64_t rank = static_cast<std::uint64_t>(dn) << kShift;
    return static_cast<Rank>(std::min<std::uint64_t>(rank, kHighest));
  };
  const Rank some = least_rank(1);
  const Rank weak = least_rank(limits.weak_dn);
  const Rank second = least_rank(limits.second_dn);
  const auto is_unclear = [&, firsts = best[0].data(),
                           seconds = best[1].data()](std::size_t line) -> Rank {
    const Rank f = firsts[line];
    const Rank s = seconds[line];
    return static_cast<Rank>((f < weak) | (s >= second));
  };
  const std::size_t lines = best_across.size();
  const auto add_line = [&](std::size_t line) {
    const auto number = static_cast<std::int32_t>(line);
    const auto first_across = static_cast<std::int32_t>(best_across[line]);
    if (best[0][line] < weak) {
      (best[0][line] < some ? rivals.flat_lines : rivals.weak_lines).push_back(number);
      return;
    }
    for (std::size_t n = 1; n < best.size() && best[n][line] >= second; ++n) {
      const auto chunk = static_cast<int>(kChunkBits - (best[n][line] & kChunkBits));
      const int across = chunks.at(chunk, number).across;
      if (!is_flank(across, first_across, limits.flank_px))
        rivals.places.push_back({number, across});
    }
  };
  // Without branches: nearly always the answer is no, a vector at a time.
  constexpr std::size_t kBlock = 16;
  for (std::size_t first = 0; first < lines; first += kBlock) {
    const std::size_t last = std::min(first + kBlock, lines);
    Rank any = 0;
    for (std::size_t line = first; line < last; ++line) any |= is_unclear(line);
    if (any == 0) continue;
    for (std::size_t line = first; line < last; ++line) {
      if (is_unclear(line) != 0) add_line(line);
    }
  }
}

}  // namespace

void ChunkMaxima::find(const LitFrame& frame, StripeAxis axis) {
  const bool columns = axis == StripeAxis::kColumns;
  axis_ = axis;
  keep_images_of_rows(frame);
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
  const auto widen = [&](const auto& numbers) {
    for (std::size_t line = 0; line < numbers.size(); ++line) {
      across[line] = static_cast<std::int32_t>(numbers[line]);
    }
  };
  if (is_wide_) {
    widen(best_across16_);
  } else {
    widen(best_across8_);
  }
}

void ChunkMaxima::find_rivals(const RivalLimits& limits, Rivals& rivals) const {
  rivals.places.clear();
  rivals.weak_lines.clear();
  rivals.flat_lines.clear();
  if (is_wide_) {
    find_rivals_in(*this, best16_, best_across16_, limits, rivals);
  } else {
    find_rivals_in(*this, best8_, best_across8_, limits, rivals);
  }
}

void ChunkMaxima::rank() {
  is_wide_ = has_wide_keys_ || chunks_ > kMostNarrowChunks;
  if (has_wide_keys_) {
    rank_into(keys16_, lines_, chunks_, best16_, best_across16_);
  } else if (is_wide_) {
    rank_into(keys8_, lines_, chunks_, best16_, best_across16_);
  } else {
    rank_into(keys8_, lines_, chunks_, best8_, best_across8_);
  }
  if (axis_ == StripeAxis::kRows) find_best_in_rows();
}

void ChunkMaxima::keep_images_of_rows(const LitFrame& frame) {
  if (axis_ != StripeAxis::kRows) return;
  row_images_.lit = frame.lit;
  row_images_.dark = frame.dark;
  row_images_.blind = frame.blind;
}

// The ranking tells which chunk; the maximum is somewhere in it.
void ChunkMaxima::find_best_in_rows() {
  if (has_wide_keys_) {
    detail::move_to_maxima_of_rows(planes_of<std::uint16_t>(row_images_), keys16_.data(), 0, lines_,
                                   best_across16_.data());
  } else if (is_wide_) {
    detail::move_to_maxima_of_rows(planes_of<std::uint8_t>(row_images_), keys8_.data(), 0, lines_,
                                   best_across16_.data());
  } else {
    detail::move_to_maxima_of_rows(planes_of<std::uint8_t>(row_images_), keys8_.data(), 0, lines_,
                                   best_across8_.data());
  }
}

int ChunkMaxima::across_in_row(int chunk, int line) const noexcept {
  auto across = static_cast<std::uint32_t>(chunk * kChunk);
  if (has_wide_keys_) {
    detail::move_to_maxima_of_rows(planes_of<std::uint16_t>(row_images_), keys16_.data(), line, 1,
                                   &across);
  } else {
    detail::move_to_maxima_of_rows(planes_of<std::uint8_t>(row_images_), keys8_.data(), line, 1,
                                   &across);
  }
  return static_cast<int>(across);
}

}  // namespace striper
