// SPDX-License-Identifier: Apache-2.0
#include "ambient/pixels/temporal_background.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

template <typename Pixel>
void median_of(const std::vector<cv::Mat>& pictures, cv::Mat& median) {
  std::array<Pixel, TemporalBackground::kFirstPictures> values{};
  std::span taken(values.data(), std::min(pictures.size(), values.size()));
  for (int row = 0; row < median.rows; ++row) {
    auto* const out = median.ptr<Pixel>(row);
    for (int col = 0; col < median.cols; ++col) {
      for (std::size_t i = 0; i < taken.size(); ++i) taken[i] = pictures[i].ptr<Pixel>(row)[col];
      // Of an even number the lower one: what is lit for half of the time is no background.
      out[col] = nth_smallest(taken, (taken.size() - 1) / 2);
    }
  }
}

template <typename Pixel>
void move_towards(const cv::Mat& picture, int step_dn, cv::Mat& background) {
  for (int row = 0; row < picture.rows; ++row) {
    const auto* const in = picture.ptr<Pixel>(row);
    auto* const out = background.ptr<Pixel>(row);
    for (int col = 0; col < picture.cols; ++col) {
      const int change = std::clamp(in[col] - out[col], -step_dn, step_dn);
      out[col] = static_cast<Pixel>(out[col] + change);
    }
  }
}

}  // namespace

void TemporalBackground::begin(const std::vector<cv::Mat>& pictures) {
  background_.create(pictures.front().size(), pictures.front().type());
  if (background_.depth() == CV_8U) {
    median_of<std::uint8_t>(pictures, background_);
  } else {
    median_of<std::uint16_t>(pictures, background_);
  }
}

const cv::Mat& TemporalBackground::follow(const cv::Mat& picture, int step_dn) {
  if (picture.size() != background_.size() || picture.type() != background_.type()) {
    picture.copyTo(background_);
  } else if (picture.depth() == CV_8U) {
    move_towards<std::uint8_t>(picture, step_dn, background_);
  } else {
    move_towards<std::uint16_t>(picture, step_dn, background_);
  }
  return background_;
}

}  // namespace striper::detail
