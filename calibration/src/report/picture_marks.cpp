// SPDX-License-Identifier: Apache-2.0
#include "report/picture_marks.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

constexpr int kThumbnailWidth = 320;
constexpr int kCropHalf = 16;
constexpr int kCropScale = 4;
const cv::Scalar kGood(80, 220, 60);
const cv::Scalar kBad(40, 40, 255);
const cv::Scalar kStripe(255, 170, 0);

std::string base64(const std::vector<unsigned char>& bytes) {
  static constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    unsigned value = static_cast<unsigned>(bytes[i]) << 16;
    if (left > 1) value |= static_cast<unsigned>(bytes[i + 1]) << 8;
    if (left > 2) value |= bytes[i + 2];
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= left ? kDigits[(value >> (18 - 6 * k)) & 63U] : '=';
  }
  return text;
}

std::string as_img(const cv::Mat& image, const char* type, const std::string& what) {
  std::vector<unsigned char> bytes;
  cv::imencode(fmt::format(".{}", type), image, bytes,
               type == std::string("jpg") ? std::vector<int>{cv::IMWRITE_JPEG_QUALITY, 72}
                                          : std::vector<int>{});
  return fmt::format("<img width=\"{}\" height=\"{}\" alt=\"{}\" src=\"data:image/{};base64,{}\">",
                     image.cols, image.rows, what, type == std::string("jpg") ? "jpeg" : type,
                     base64(bytes));
}

cv::Mat in_colour(const cv::Mat& image) {
  cv::Mat eight;
  if (image.depth() == CV_16U) {
    double brightest = 0.0;
    cv::minMaxLoc(image.reshape(1), nullptr, &brightest);
    image.convertTo(eight, CV_8U, 255.0 / std::max(brightest, 255.0));
  } else {
    eight = image;
  }
  cv::Mat colour;
  if (eight.channels() == 1)
    cv::cvtColor(eight, colour, cv::COLOR_GRAY2BGR);
  else
    colour = eight.clone();
  return colour;
}

// OpenCV draws with sixteenths of a pixel when asked to shift by 4.
cv::Point fixed(const Eigen::Vector2d& p, double scale) {
  return {static_cast<int>(std::lround(16.0 * ((p.x() + 0.5) * scale - 0.5))),
          static_cast<int>(std::lround(16.0 * ((p.y() + 0.5) * scale - 0.5)))};
}

}  // namespace

std::string thumbnail(const Calibration& calibration, const ImageResult& result) {
  cv::Mat image;
  try {
    image = in_colour(result.laser >= 0 ? result.lit.load() : result.image.load());
  } catch (const Error&) {
    return {};
  }
  const double scale = static_cast<double>(kThumbnailWidth) / image.cols;
  cv::Mat small;
  cv::resize(image, small, {}, scale, scale, cv::INTER_AREA);
  const BoardView& board = result.board;
  for (std::size_t i = 0; i < board.corners_px.size(); ++i) {
    const bool good = result.view >= 0 && board.reliable[i] != 0;
    cv::circle(small, fixed(board.corners_px[i], scale), 32, good ? kGood : kBad, 1, cv::LINE_AA,
               4);
  }
  if (result.stripe_view >= 0)
    for (const auto& p :
         calibration.observations.stripes[static_cast<std::size_t>(result.stripe_view)].pixel)
      cv::circle(small, fixed(p, scale), 16, kStripe, cv::FILLED, cv::LINE_AA, 4);
  return as_img(small, "jpg", "image");
}

std::string outlier_crop(const Calibration& calibration, const OutlierPoint& outlier) {
  const auto k = static_cast<std::size_t>(outlier.view);
  const auto i = static_cast<std::size_t>(outlier.index);
  const Eigen::Vector2d at = outlier.is_stripe ? calibration.observations.stripes[k].pixel[i]
                                               : calibration.observations.views[k].pixel[i];
  const auto result =
      std::find_if(calibration.images.begin(), calibration.images.end(), [&](const ImageResult& p) {
        return outlier.is_stripe ? p.stripe_view == outlier.view : p.view == outlier.view;
      });
  if (result == calibration.images.end()) return {};
  try {
    const cv::Mat image = in_colour(outlier.is_stripe ? result->lit.load() : result->image.load());
    const cv::Point middle(static_cast<int>(std::lround(at.x())),
                           static_cast<int>(std::lround(at.y())));
    const cv::Rect window =
        cv::Rect(middle.x - kCropHalf, middle.y - kCropHalf, 2 * kCropHalf + 1, 2 * kCropHalf + 1) &
        cv::Rect(0, 0, image.cols, image.rows);
    if (window.empty()) return {};
    cv::Mat crop;
    cv::resize(image(window), crop, {}, kCropScale, kCropScale, cv::INTER_NEAREST);
    const Eigen::Vector2d inside(at.x() - window.x, at.y() - window.y);
    cv::circle(crop, fixed(inside, kCropScale), 16 * 8, kBad, 1, cv::LINE_AA, 4);
    return as_img(crop, "png", "outlier");
  } catch (const Error&) {
    return {};
  }
}

}  // namespace striper::detail
