// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "stripe/candidates/ridges/ridges.hpp"

#include <algorithm>

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/candidates/ridges/ridges.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
// clang-format on

#ifndef STRIPER_RIDGES_ROW
#define STRIPER_RIDGES_ROW
namespace striper::detail {

// Pixels, and their neighbours before and after.
template <typename Pixel>
struct RidgeRow {
  const Pixel* value;
  const Pixel* before;
  const Pixel* after;
  std::size_t count;
};

// Where the pixels are that rise far enough, and how far they rise.
struct RidgeHits {
  std::uint32_t* at;
  std::uint16_t* rise;
};

}  // namespace striper::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

template <typename Pixel>
std::size_t hits_of(const RidgeRow<Pixel>& row, Pixel least, const RidgeHits& hits) {
  const hn::ScalableTag<Pixel> d;
  const std::size_t lanes = hn::Lanes(d);
  const auto limit = hn::Set(d, least);
  std::size_t found = 0;
  const auto look_at = [&](std::size_t i) {
    const Pixel side = std::max(row.before[i], row.after[i]);
    const Pixel rise = row.value[i] > side ? static_cast<Pixel>(row.value[i] - side) : Pixel{0};
    hits.at[found] = static_cast<std::uint32_t>(i);
    hits.rise[found] = rise;
    found += static_cast<std::size_t>(rise >= least);
  };
  std::size_t i = 0;
  for (; i + lanes <= row.count; i += lanes) {
    const auto side = hn::Max(hn::LoadU(d, row.before + i), hn::LoadU(d, row.after + i));
    const auto rise = hn::SaturatedSub(hn::LoadU(d, row.value + i), side);
    if (hn::AllFalse(d, hn::Eq(hn::Max(rise, limit), rise))) continue;
    for (std::size_t k = i; k < i + lanes; ++k) look_at(k);
  }
  for (; i < row.count; ++i) look_at(i);
  return found;
}

std::size_t hits_u8(const RidgeRow<std::uint8_t>& row, std::uint8_t least, const RidgeHits& hits) {
  return hits_of(row, least, hits);
}
std::size_t hits_u16(const RidgeRow<std::uint16_t>& row, std::uint16_t least,
                     const RidgeHits& hits) {
  return hits_of(row, least, hits);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(hits_u8);
HWY_EXPORT(hits_u16);

namespace {

std::size_t find_hits(const RidgeRow<std::uint8_t>& row, int least, const RidgeHits& hits) {
  return HWY_DYNAMIC_DISPATCH(hits_u8)(row, static_cast<std::uint8_t>(std::min(least, 255)), hits);
}
std::size_t find_hits(const RidgeRow<std::uint16_t>& row, int least, const RidgeHits& hits) {
  return HWY_DYNAMIC_DISPATCH(hits_u16)(row, static_cast<std::uint16_t>(std::min(least, 65535)),
                                        hits);
}

// Hits nearer than this are of one ridge.
constexpr std::int32_t kSameRidge = 2;

}  // namespace

void Ridges::reserve(const cv::Size& size, StripeAxis axis) {
  const bool is_down = axis == StripeAxis::kColumns;
  lines_.clear();  // Nothing of the last image is copied.
  lines_.resize(static_cast<std::size_t>(is_down ? size.width : size.height));
  hits_.resize(static_cast<std::size_t>(size.width) + 1);
  rises_.resize(hits_.size());
  if (!is_down) padded_.resize(2 * static_cast<std::size_t>(3 * size.width));
}

void Ridges::find(const cv::Mat& image, StripeAxis axis, int distance_px, int least_dn) {
  const bool is_down = axis == StripeAxis::kColumns;
  reserve(image.size(), axis);
  for (Line& line : lines_) line.count = 0;
  for (Line& line : lines_) line.latest = kMost;
  if (image.depth() == CV_8U) {
    is_down ? find_down<std::uint8_t>(image, distance_px, least_dn)
            : find_along<std::uint8_t>(image, distance_px, least_dn);
  } else {
    is_down ? find_down<std::uint16_t>(image, distance_px, least_dn)
            : find_along<std::uint16_t>(image, distance_px, least_dn);
  }
}

template <typename Pixel>
void Ridges::find_down(const cv::Mat& image, int distance, int least_dn) {
  const int last = image.rows - 1;
  for (int row = 0; row <= last; ++row) {
    const int before = row - distance >= 0 ? row - distance : std::min(row + distance, last);
    const int after = row + distance <= last ? row + distance : std::max(row - distance, 0);
    const std::size_t found =
        find_hits(RidgeRow<Pixel>{image.ptr<Pixel>(row), image.ptr<Pixel>(before),
                                  image.ptr<Pixel>(after), static_cast<std::size_t>(image.cols)},
                  least_dn, {hits_.data(), rises_.data()});
    for (std::size_t n = 0; n < found; ++n) add(lines_[hits_[n]], {row, rises_[n]});
  }
}

template <typename Pixel>
void Ridges::find_along(const cv::Mat& image, int distance, int least_dn) {
  const auto reach = std::min(distance, image.cols - 1);
  auto* const padded = reinterpret_cast<Pixel*>(padded_.data());
  for (int row = 0; row < image.rows; ++row) {
    const Pixel* const in = image.ptr<Pixel>(row);
    Pixel* const out = padded;
    // Beyond a border stands the neighbour on the other side.
    std::copy_n(in, image.cols, out + reach);
    for (int k = 0; k < reach; ++k) {
      out[k] = in[std::min(k + reach, image.cols - 1)];
      out[image.cols + reach + k] = in[std::max(0, image.cols - reach + k - reach)];
    }
    const std::size_t found = find_hits(
        RidgeRow<Pixel>{out + reach, out, out + 2 * reach, static_cast<std::size_t>(image.cols)},
        least_dn, {hits_.data(), rises_.data()});
    Line& line = lines_[static_cast<std::size_t>(row)];
    for (std::size_t n = 0; n < found; ++n) {
      add(line, {static_cast<std::int32_t>(hits_[n]), rises_[n]});
    }
  }
}

void Ridges::add_run(int line, int first, int last, int rise_dn) {
  Line& l = lines_[static_cast<std::size_t>(line)];
  const auto end = std::remove_if(
      l.ridges.begin(), l.ridges.begin() + static_cast<std::ptrdiff_t>(l.count),
      [&](const Ridge& ridge) { return ridge.across >= first && ridge.across <= last; });
  l.count = static_cast<std::size_t>(end - l.ridges.begin());
  l.latest = kMost;
  add(l, {(first + last) / 2, rise_dn});
}

// Ridges come in rising order across.
void Ridges::add(Line& line, const Ridge& ridge) const {
  if (line.latest < kMost) {
    Ridge& latest = line.ridges[line.latest];
    if (ridge.across - latest.across <= kSameRidge) {
      if (ridge.rise_dn > latest.rise_dn) latest = ridge;
      return;
    }
  }
  if (line.count < kMost) {
    line.latest = line.count++;
    line.ridges[line.latest] = ridge;
    return;
  }
  const auto lowest =
      std::min_element(line.ridges.begin(), line.ridges.end(),
                       [](const Ridge& a, const Ridge& b) { return a.rise_dn < b.rise_dn; });
  line.latest = kMost;
  if (lowest->rise_dn >= ridge.rise_dn) return;
  *lowest = ridge;
  line.latest = static_cast<std::size_t>(lowest - line.ridges.begin());
}

}  // namespace striper::detail
#endif  // HWY_ONCE
