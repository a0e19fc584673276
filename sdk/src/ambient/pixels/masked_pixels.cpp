// SPDX-License-Identifier: Apache-2.0
#include "ambient/pixels/masked_pixels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace striper::detail {
namespace {

constexpr int kBlockCols = 16;
constexpr int kBlockRows = 8;

constexpr int kBlindRows = 4;  // Saturated pixels spoil their neighbours: blooming, lens flare.
constexpr int kBlindCols = 2;
// No stripe is clipped over so many rows.
constexpr int kLongestStripeRun = 15;
// A light source saturates the lit exposure at most so many blocks from where it did the dark; one
// that is elsewhere in the other dark exposure, so many: 25 m/s across the view at 2 m.
constexpr int kLightSourceReachBlocks = 4;
constexpr int kMovingLightSourceReachBlocks = 10;

constexpr std::uint8_t kBefore = 1;
constexpr std::uint8_t kAfter = 2;

constexpr std::uint8_t kLitSaturated = 1;
constexpr std::uint8_t kDarkSaturated = 2;

// Marks of a pixel: what saturates it, and whether it was taken for a blob's.
constexpr std::uint8_t kInDark = 1;
constexpr std::uint8_t kInLit = 2;
constexpr std::uint8_t kTaken = 4;

// A flare is brighter than what is subtracted, or darker, in so much more of the pixels along a
// side of the light source than the other way round; noise is so in as many. It is no wider than
// this.
constexpr double kFlareSurplus = 0.5;
constexpr int kWidestFlare = 16;

// Of the pixels of a scan line those that are brighter less those that are darker, as a fraction.
template <typename Pixel>
double surplus(const cv::Mat& lit, const cv::Mat& dark, const cv::Rect& line) {
  int brighter = 0;
  for (int row = line.y; row < line.y + line.height; ++row) {
    const auto* const p = lit.ptr<Pixel>(row);
    const auto* const q = dark.ptr<Pixel>(row);
    for (int col = line.x; col < line.x + line.width; ++col) {
      brighter += (p[col] > q[col] ? 1 : 0) - (p[col] < q[col] ? 1 : 0);
    }
  }
  return static_cast<double>(brighter) / std::max(1, line.area());
}

}  // namespace

void MaskedPixels::prepare(cv::Size size) {
  if (size == marked_.size()) return;
  block_rows_ = (size.height + kBlockRows - 1) / kBlockRows;
  block_cols_ = (size.width + kBlockCols - 1) / kBlockCols;
  light_sources_.assign(
      static_cast<std::size_t>(block_rows_) * static_cast<std::size_t>(block_cols_), 0);
  run_.assign(static_cast<std::size_t>(size.width), 0);
  saturated_.assign(static_cast<std::size_t>(size.height), 0);
  blob_.reserve(static_cast<std::size_t>(size.area()));
  masked_ = cv::Mat::zeros(size, CV_8U);
  marked_ = cv::Mat::zeros(size, CV_8U);
}

void MaskedPixels::set_row(int row, bool in_lit, bool in_dark) noexcept {
  saturated_[static_cast<std::size_t>(row)] =
      static_cast<std::uint8_t>((in_lit ? kLitSaturated : 0) | (in_dark ? kDarkSaturated : 0));
}

cv::Mat MaskedPixels::find(const cv::Mat& lit, const cv::Mat* before, const cv::Mat* after,
                           const cv::Mat& dark, int full_scale_dn) {
  const bool any_row = std::any_of(saturated_.begin(), saturated_.end(),
                                   [](std::uint8_t flags) { return flags != 0; });
  if (!any_row) return {};
  std::memset(marked_.data, 0, marked_.total());
  std::fill(light_sources_.begin(), light_sources_.end(), std::uint8_t{0});
  const bool any = lit.depth() == CV_8U ? mark<std::uint8_t>(lit, before, after, full_scale_dn)
                                        : mark<std::uint16_t>(lit, before, after, full_scale_dn);
  if (!any) return {};
  dilate();
  if (lit.depth() == CV_8U) {
    mark_flares<std::uint8_t>(lit, dark);
  } else {
    mark_flares<std::uint16_t>(lit, dark);
  }
  return masked_;
}

// Marks what a dark exposure saturates, then what a light source saturates in the lit one. Returns
// whether there is any.
template <typename Pixel>
bool MaskedPixels::mark(const cv::Mat& lit, const cv::Mat* before, const cv::Mat* after,
                        int full_scale_dn) {
  bool any = false;
  for (int row = 0; row < lit.rows; ++row) {
    if ((saturated_[static_cast<std::size_t>(row)] & kDarkSaturated) == 0) continue;
    if (before != nullptr && row < before->rows) {
      mark_dark_row(before->ptr<Pixel>(row), row, kBefore, full_scale_dn);
    }
    if (after != nullptr && row < after->rows) {
      mark_dark_row(after->ptr<Pixel>(row), row, kAfter, full_scale_dn);
    }
    any = true;
  }
  const bool moves = before != nullptr && after != nullptr && have_light_sources_moved();
  light_source_reach_ = moves ? kMovingLightSourceReachBlocks : kLightSourceReachBlocks;
  return mark_lit_rows<Pixel>(lit, full_scale_dn) || any;
}

template <typename Pixel>
void MaskedPixels::mark_dark_row(const Pixel* pixels, int row, std::uint8_t exposure,
                                 int full_scale_dn) {
  auto* const marks = marked_.ptr<std::uint8_t>(row);
  std::uint8_t* const light_sources = light_sources_.data() + (row / kBlockRows) * block_cols_;
  for (int col = 0; col < marked_.cols; ++col) {
    if (pixels[col] < full_scale_dn) continue;
    marks[col] = kInDark;
    light_sources[col / kBlockCols] |= exposure;
  }
}

template <typename Pixel>
bool MaskedPixels::mark_lit_rows(const cv::Mat& lit, int full_scale_dn) {
  std::fill(run_.begin(), run_.end(), 0);
  bool any = false;
  for (int row = 0; row < lit.rows; ++row) {
    if ((saturated_[static_cast<std::size_t>(row)] & kLitSaturated) == 0) {
      std::fill(run_.begin(), run_.end(), 0);
      continue;
    }
    const auto* const pixels = lit.ptr<Pixel>(row);
    for (int col = 0; col < lit.cols; ++col) {
      int& run = run_[static_cast<std::size_t>(col)];
      run = pixels[col] >= full_scale_dn ? run + 1 : 0;
      if (run == 0) continue;
      const bool is_long = run > kLongestStripeRun;
      if (!is_long && !is_near_light_source(row, col)) continue;
      const int first = run == kLongestStripeRun + 1 ? row - kLongestStripeRun : row;
      for (int r = first; r <= row; ++r) marked_.at<std::uint8_t>(r, col) |= kInLit;
      any = true;
    }
  }
  return any;
}

bool MaskedPixels::is_near_light_source(int row, int col) const {
  const int block_row = row / kBlockRows;
  const int block_col = col / kBlockCols;
  for (int r = std::max(0, block_row - 1); r <= std::min(block_rows_ - 1, block_row + 1); ++r) {
    const int last = std::min(block_cols_ - 1, block_col + light_source_reach_);
    for (int c = std::max(0, block_col - light_source_reach_); c <= last; ++c) {
      if (light_sources_[static_cast<std::size_t>(r * block_cols_ + c)] != 0) return true;
    }
  }
  return false;
}

// Whether a light source of one dark exposure is not where the other one has any.
bool MaskedPixels::have_light_sources_moved() const {
  for (int row = 0; row < block_rows_; ++row) {
    for (int col = 0; col < block_cols_; ++col) {
      if (light_sources_[static_cast<std::size_t>(row * block_cols_ + col)] == 0) continue;
      std::uint8_t about = 0;
      for (int r = std::max(0, row - 1); r <= std::min(block_rows_ - 1, row + 1); ++r) {
        for (int c = std::max(0, col - 1); c <= std::min(block_cols_ - 1, col + 1); ++c) {
          about |= light_sources_[static_cast<std::size_t>(r * block_cols_ + c)];
        }
      }
      if (about != (kBefore | kAfter)) return true;
    }
  }
  return false;
}

// Of what saturates one exposure and not the other: about as far as the difference is of one sign.
// What stands still has its flare in both.
template <typename Pixel>
void MaskedPixels::mark_flares(const cv::Mat& lit, const cv::Mat& dark) {
  const cv::Rect image({}, marked_.size());
  for (int row = 0; row < marked_.rows; ++row) {
    if (saturated_[static_cast<std::size_t>(row)] == 0) continue;
    for (int col = 0; col < marked_.cols; ++col) {
      const std::uint8_t mark = marked_.ptr<std::uint8_t>(row)[col];
      if (mark == 0 || (mark & kTaken) != 0) continue;
      bool stands = false;
      cv::Rect box = take_blob(row, col, stands);
      if (stands) continue;
      box = cv::Rect(box.x - kBlindCols, box.y - kBlindRows, box.width + 2 * kBlindCols,
                     box.height + 2 * kBlindRows) &
            image;
      const auto is_flare = [&](const cv::Rect& line) {
        return !(line & image).empty() &&
               std::abs(surplus<Pixel>(lit, dark, line & image)) > kFlareSurplus;
      };
      const cv::Rect core = box;
      while (core.x - box.x < kWidestFlare && is_flare({box.x - 1, core.y, 1, core.height})) {
        --box.x;
        ++box.width;
      }
      while (box.br().x - core.br().x < kWidestFlare &&
             is_flare({box.br().x, core.y, 1, core.height})) {
        ++box.width;
      }
      while (core.y - box.y < kWidestFlare && is_flare({core.x, box.y - 1, core.width, 1})) {
        --box.y;
        ++box.height;
      }
      while (box.br().y - core.br().y < kWidestFlare &&
             is_flare({core.x, box.br().y, core.width, 1})) {
        ++box.height;
      }
      if (box != core) mask_out(box);
    }
  }
}

// The box of the marked pixels that are connected to this one. @param stands whether most of them
// are saturated in a dark exposure and in the lit one.
cv::Rect MaskedPixels::take_blob(int row, int col, bool& stands) {
  const cv::Rect image({}, marked_.size());
  cv::Point low(col, row);
  cv::Point high = low;
  std::size_t in_both = 0;
  std::size_t pixels = 0;
  blob_.assign(1, low);
  marked_.at<std::uint8_t>(low) |= kTaken;
  while (!blob_.empty()) {
    const cv::Point at = blob_.back();
    blob_.pop_back();
    low = {std::min(low.x, at.x), std::min(low.y, at.y)};
    high = {std::max(high.x, at.x), std::max(high.y, at.y)};
    ++pixels;
    if (marked_.at<std::uint8_t>(at) == (kInDark | kInLit | kTaken)) ++in_both;
    for (const cv::Point step : {cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
      const cv::Point next = at + step;
      if (!image.contains(next)) continue;
      std::uint8_t& mark = marked_.at<std::uint8_t>(next);
      if (mark == 0 || (mark & kTaken) != 0) continue;
      mark |= kTaken;
      blob_.push_back(next);
    }
  }
  stands = 2 * in_both > pixels;
  return {low.x, low.y, high.x - low.x + 1, high.y - low.y + 1};
}

void MaskedPixels::mask_out(const cv::Rect& box) {
  for (int row = box.y; row < box.y + box.height; ++row) {
    auto* const masked = masked_.ptr<std::uint8_t>(row);
    std::fill(masked + box.x, masked + box.x + box.width, std::uint8_t{1});
  }
}

// A pixel is masked if a marked one is within kBlindRows and kBlindCols.
void MaskedPixels::dilate() {
  std::memset(masked_.data, 0, masked_.total());
  for (int row = 0; row < marked_.rows; ++row) {
    const auto* const marks = marked_.ptr<std::uint8_t>(row);
    const int last_row = std::min(marked_.rows - 1, row + kBlindRows);
    for (int col = 0; col < marked_.cols; ++col) {
      if (marks[col] == 0) continue;
      const int first_col = std::max(0, col - kBlindCols);
      const int last_col = std::min(marked_.cols - 1, col + kBlindCols);
      for (int r = std::max(0, row - kBlindRows); r <= last_row; ++r) {
        auto* const masked = masked_.ptr<std::uint8_t>(r);
        std::fill(masked + first_col, masked + last_col + 1, std::uint8_t{1});
      }
    }
  }
}

}  // namespace striper::detail
