// SPDX-License-Identifier: Apache-2.0
#include "ambient/line_sign.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace striper::detail {
namespace {

// Lines averaged: a stripe rarely climbs more than a few pixels over them.
constexpr int kBand = 8;
constexpr int kMostBands = 40;
// A line is no wider than this to either side; beyond, over as much, are its sides.
constexpr int kSide = 7;
constexpr int kReach = kSide + 1;

// The path of a line from band to band (see band_profiles): no place counts for more than a clear
// line or for less than a gap may cost, and climbing costs a little.
constexpr int kLongestPath = 512;
constexpr float kClear = 5.0F;
constexpr float kGap = -1.0F;
constexpr float kTollPerJump = 0.2F;
constexpr float kSteepest = 0.4F;
constexpr int kLeastJump = 3;

int first_line(int band, int bands, int lines) {
  return bands == 1 ? 0 : band * (lines - std::min(kBand, lines)) / (bands - 1);
}

}  // namespace

template <typename Pixel>
void LineSign::average_bands(const cv::Mat& over, const cv::Mat& under, StripeAxis axis) {
  const bool columns = axis == StripeAxis::kColumns;
  const int lines = columns ? over.cols : over.rows;
  const int width = std::min(kBand, lines);
  const auto places = static_cast<std::size_t>(length_ + 2 * kReach);
  std::fill(values_.begin(), values_.end(), 0.0F);
  // Row by row of the image, as it lies in memory.
  const int rows = columns ? length_ + 2 * kReach : over.rows;
  for (int row = 0; row < rows; ++row) {
    const auto* const p = over.ptr<Pixel>(row);
    const auto* const q = under.ptr<Pixel>(row);
    for (int band = 0; band < bands_; ++band) {
      const int first = first_line(band, bands_, lines);
      float* const values = values_.data() + static_cast<std::size_t>(band) * places;
      if (columns) {
        int sum = 0;
        for (int i = first; i < first + width; ++i) sum += p[i] - q[i];
        values[row] = static_cast<float>(sum);
      } else if (row >= first && row < first + width) {
        for (std::size_t k = 0; k < places; ++k) values[k] += static_cast<float>(p[k] - q[k]);
      }
    }
  }
  for (float& value : values_) value /= static_cast<float>(width);
}

void LineSign::find_heights() {
  for (int band = 0; band < bands_; ++band) {
    const auto n = static_cast<std::size_t>(band);
    const float* const values = values_.data() + n * static_cast<std::size_t>(length_ + 2 * kReach);
    const auto mean_of_three = [values](int k) {
      return (values[k - 1] + values[k] + values[k + 1]) * (1.0F / 3.0F);
    };
    for (int k = 0; k < length_; ++k) {
      const float middle = mean_of_three(k + kReach);
      const float before = mean_of_three(k + kReach - kSide);
      const float after = mean_of_three(k + kReach + kSide);
      const std::size_t i = n * static_cast<std::size_t>(length_) + static_cast<std::size_t>(k);
      bright_[i] = middle - std::max(before, after);
      dark_[i] = std::min(before, after) - middle;
    }
  }
}

// One sigma of a height over the mean of its sides, which is half of what both signs say; a line
// and edges are few and do not move a median.
float LineSign::noise_of_heights() {
  constexpr std::size_t kSamples = 2048;
  sorted_.clear();
  const std::size_t stride = std::max<std::size_t>(1, bright_.size() / kSamples) | 1U;
  for (std::size_t i = 0; i < bright_.size(); i += stride) {
    sorted_.push_back(0.5F * std::abs(bright_[i] - dark_[i]));
  }
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  constexpr float kLeast = 0.3F;  // Pictures without any noise still have rounding.
  return std::max(kLeast, 1.4826F * *middle);
}

LineSign::Strength LineSign::of(const cv::Mat& over, const cv::Mat& under, const cv::Mat& variance,
                                StripeAxis axis) {
  const bool columns = axis == StripeAxis::kColumns;
  const int lines = columns ? over.cols : over.rows;
  length_ = (columns ? std::min(over.rows, under.rows) : over.cols) - 2 * kReach;
  bands_ = std::min(kMostBands, lines);
  size_ = over.size();
  if (length_ <= 0 || bands_ <= 0) return {};
  values_.resize(static_cast<std::size_t>(bands_) * static_cast<std::size_t>(length_ + 2 * kReach));
  bright_.resize(static_cast<std::size_t>(bands_) * static_cast<std::size_t>(length_));
  dark_.resize(bright_.size());
  sorted_.reserve(bright_.size());
  if (over.depth() == CV_8U) {
    average_bands<std::uint8_t>(over, under, axis);
  } else {
    average_bands<std::uint16_t>(over, under, axis);
  }
  find_heights();

  const float noise = noise_of_heights();
  return {strength(bright_, noise, variance, axis), strength(dark_, noise, variance, axis)};
}

// The mean height, in sigmas, of the best path from band to band.
float LineSign::strength(const std::vector<float>& heights, float noise, const cv::Mat& variance,
                         StripeAxis axis) {
  const bool columns = axis == StripeAxis::kColumns;
  const int lines = columns ? size_.width : size_.height;
  const int fold = (length_ + kLongestPath - 1) / kLongestPath;
  const int places = (length_ + fold - 1) / fold;
  const float climb = kSteepest * static_cast<float>(lines) / static_cast<float>(bands_);
  const int jump = std::max(kLeastJump, static_cast<int>(std::ceil(climb)) / fold);
  // Nothing comes from beyond either end.
  constexpr float kNever = -1e6F;
  const auto row = static_cast<std::size_t>(places + 2 * jump);
  path_.assign(2 * row, kNever);
  float* best = path_.data() + jump;
  float* next = best + row;
  std::fill(best, best + places, 0.0F);
  for (int band = 0; band < bands_; ++band) {
    const int line = first_line(band, bands_, lines) + std::min(kBand, lines) / 2;
    const float* const own = heights.data() + static_cast<std::ptrdiff_t>(band) * length_;
    const auto sigmas = [&](int k) {
      if (variance.empty()) return own[k] / noise;
      const int at = k + kReach;
      const float extra = columns ? variance.ptr<float>(at)[line] : variance.ptr<float>(line)[at];
      return own[k] / std::sqrt(noise * noise + extra);
    };
    std::copy(best, best + places, next);
    for (int j = 1; j <= jump; ++j) {
      const float toll = kTollPerJump * static_cast<float>(j);
      for (int i = 0; i < places; ++i) {
        next[i] = std::max(next[i], std::max(best[i - j], best[i + j]) - toll);
      }
    }
    for (int i = 0; i < places; ++i) {
      float highest = kGap;
      for (int k = i * fold; k < std::min(length_, (i + 1) * fold); ++k) {
        highest = std::max(highest, sigmas(k));
      }
      next[i] += std::min(highest, kClear);
    }
    std::swap(best, next);
  }
  return *std::max_element(best, best + places) / static_cast<float>(bands_);
}

}  // namespace striper::detail
