// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/line_sign.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

// Lines averaged: a stripe rarely climbs more than a few pixels over them.
constexpr int kBand = 8;
constexpr int kMostBands = 40;
constexpr int kSide = LinePath::kSide;
constexpr int kReach = kSide + 1;

int first_line(int band, int bands, int lines) {
  return bands == 1 ? 0 : band * (lines - std::min(kBand, lines)) / (bands - 1);
}

}  // namespace

template <typename Pixel>
void LineSign::average_bands(const cv::Mat& over, const cv::Mat& under, StripeAxis axis) {
  const int lines = axis == StripeAxis::kColumns ? over.cols : over.rows;
  // A width that is known when this is compiled is added up in a vector.
  if (axis == StripeAxis::kColumns && lines >= kBand) {
    add_columns<Pixel>(over, under, std::integral_constant<int, kBand>());
  } else if (axis == StripeAxis::kColumns) {
    add_columns<Pixel>(over, under, lines);
  } else {
    add_rows<Pixel>(over, under);
  }
  const float per_width = 1.0F / static_cast<float>(std::min(kBand, lines));
  for (float& value : values_) value *= per_width;
}

// Row by row of the image, as it lies in memory.
template <typename Pixel, typename Width>
void LineSign::add_columns(const cv::Mat& over, const cv::Mat& under, Width any_width) {
  const int width = any_width;
  const auto places = static_cast<std::size_t>(length_ + 2 * kReach);
  std::array<int, kMostBands> first{};
  for (int band = 0; band < bands_; ++band) {
    first[static_cast<std::size_t>(band)] = first_line(band, bands_, over.cols);
  }
  for (std::size_t row = 0; row < places; ++row) {
    const auto* const p = over.ptr<Pixel>(static_cast<int>(row));
    const auto* const q = under.ptr<Pixel>(static_cast<int>(row));
    for (std::size_t band = 0; band < static_cast<std::size_t>(bands_); ++band) {
      const auto* const a = p + first[band];
      const auto* const b = q + first[band];
      int sum = 0;
      for (int i = 0; i < width; ++i) sum += a[i] - b[i];
      values_[band * places + row] = static_cast<float>(sum);
    }
  }
}

template <typename Pixel>
void LineSign::add_rows(const cv::Mat& over, const cv::Mat& under) {
  const int width = std::min(kBand, over.rows);
  const auto places = static_cast<std::size_t>(length_ + 2 * kReach);
  std::fill(values_.begin(), values_.end(), 0.0F);
  for (int band = 0; band < bands_; ++band) {
    const int first = first_line(band, bands_, over.rows);
    float* const values = values_.data() + static_cast<std::size_t>(band) * places;
    for (int row = first; row < first + width; ++row) {
      const auto* const p = over.ptr<Pixel>(row);
      const auto* const q = under.ptr<Pixel>(row);
      for (std::size_t k = 0; k < places; ++k) values[k] += static_cast<float>(p[k] - q[k]);
    }
  }
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
  constexpr float kLeast = 0.3F;  // Pictures without any noise still have rounding.
  return std::max(kLeast, static_cast<float>(robust_sigma(sorted_)));
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
  path_.begin(length_, LinePath::most_jump(lines, bands_));
  sigmas_.resize(static_cast<std::size_t>(length_));
  folded_.resize(static_cast<std::size_t>(path_.places()));
  const float per_noise = 1.0F / noise;
  for (int band = 0; band < bands_; ++band) {
    const int line = first_line(band, bands_, lines) + std::min(kBand, lines) / 2;
    const float* const own = heights.data() + static_cast<std::ptrdiff_t>(band) * length_;
    if (variance.empty()) {
      for (std::size_t k = 0; k < sigmas_.size(); ++k) sigmas_[k] = own[k] * per_noise;
    } else {
      for (std::size_t k = 0; k < sigmas_.size(); ++k) {
        const int at = static_cast<int>(k) + kReach;
        const float extra = columns ? variance.ptr<float>(at)[line] : variance.ptr<float>(line)[at];
        sigmas_[k] = own[k] / std::sqrt(noise * noise + extra);
      }
    }
    LinePath::fold(sigmas_, folded_);
    path_.add(folded_);
  }
  return path_.strength();
}

}  // namespace striper::detail
