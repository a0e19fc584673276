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
void median_of(const std::vector<cv::Mat>& images, cv::Mat& median) {
  std::array<Pixel, TemporalBackground::kFirstImages> values{};
  std::span taken(values.data(), std::min(images.size(), values.size()));
  for (int row = 0; row < median.rows; ++row) {
    auto* const out = median.ptr<Pixel>(row);
    for (int col = 0; col < median.cols; ++col) {
      for (std::size_t i = 0; i < taken.size(); ++i) taken[i] = images[i].ptr<Pixel>(row)[col];
      // Of an even number the lower one: what is lit for half of the time is no background.
      out[col] = nth_smallest(taken, (taken.size() - 1) / 2);
    }
  }
}

template <typename Pixel>
void move_towards(const cv::Mat& image, int step_dn, cv::Mat& background) {
  for (int row = 0; row < image.rows; ++row) {
    const auto* const in = image.ptr<Pixel>(row);
    auto* const out = background.ptr<Pixel>(row);
    for (int col = 0; col < image.cols; ++col) {
      const int change = std::clamp(in[col] - out[col], -step_dn, step_dn);
      out[col] = static_cast<Pixel>(out[col] + change);
    }
  }
}

}  // namespace

void TemporalBackground::begin(const std::vector<cv::Mat>& images) {
  background_.create(images.front().size(), images.front().type());
  if (background_.depth() == CV_8U) {
    median_of<std::uint8_t>(images, background_);
  } else {
    median_of<std::uint16_t>(images, background_);
  }
}

const cv::Mat& TemporalBackground::follow(const cv::Mat& image, int step_dn) {
  if (image.size() != background_.size() || image.type() != background_.type()) {
    image.copyTo(background_);
  } else if (image.depth() == CV_8U) {
    move_towards<std::uint8_t>(image, step_dn, background_);
  } else {
    move_towards<std::uint16_t>(image, step_dn, background_);
  }
  return background_;
}

}  // namespace striper::detail
