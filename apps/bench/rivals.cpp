// SPDX-License-Identifier: Apache-2.0
#include "rivals.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "keep.hpp"

namespace striper::speed {
namespace {

// Whether the ridge of the local parabola runs through the pixel, and is dark-bright-dark enough.
bool is_ridge(float dx, float dy, float dxx, float dxy, float dyy) {
  constexpr float kLeastBend = 20.0F;
  const float root = std::sqrt(0.25F * (dxx - dyy) * (dxx - dyy) + dxy * dxy);
  const float bend = 0.5F * (dxx + dyy) - root;
  if (bend > -kLeastBend) return false;
  const bool is_turned = std::abs(dxy) > 1e-6F;
  const float nx = is_turned ? bend - dyy : (dxx < dyy ? 1.0F : 0.0F);
  const float ny = is_turned ? dxy : (dxx < dyy ? 0.0F : 1.0F);
  const float step = -(dx * nx + dy * ny) / (dxx * nx * nx + 2.0F * dxy * nx * ny + dyy * ny * ny);
  return std::abs(step) * std::max(std::abs(nx), std::abs(ny)) < 0.5F;
}

}  // namespace

void reduce_argmax(const cv::Mat& image) {
  cv::Mat rows;
  cv::reduceArgMax(image, rows, 0);
  keep(rows);
}

void transpose_and_search(const cv::Mat& image) {
  cv::Mat turned;
  cv::transpose(image, turned);
  for (int line = 0; line < turned.rows; ++line) {
    cv::Point where;
    cv::minMaxLoc(turned.row(line), nullptr, nullptr, nullptr, &where);
    keep(where);
  }
}

void blur_and_search(const cv::Mat& image) {
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {1, 7}, 0.0, 1.5);
  reduce_argmax(smooth);
}

int steger(const cv::Mat& image) {
  cv::Mat smooth;
  image.convertTo(smooth, CV_32F);
  cv::GaussianBlur(smooth, smooth, {0, 0}, 1.5);
  cv::Mat dx, dy, dxx, dxy, dyy;
  cv::Sobel(smooth, dx, CV_32F, 1, 0);
  cv::Sobel(smooth, dy, CV_32F, 0, 1);
  cv::Sobel(smooth, dxx, CV_32F, 2, 0);
  cv::Sobel(smooth, dxy, CV_32F, 1, 1);
  cv::Sobel(smooth, dyy, CV_32F, 0, 2);
  int points = 0;
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      points += is_ridge(dx.at<float>(r, c), dy.at<float>(r, c), dxx.at<float>(r, c),
                         dxy.at<float>(r, c), dyy.at<float>(r, c))
                    ? 1
                    : 0;
    }
  }
  return points;
}

}  // namespace striper::speed
