// SPDX-License-Identifier: Apache-2.0
// The picture that daylight and lamps make: one ray a pixel, more where the picture has an edge.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "simulator/gaussian_integral.hpp"
#include "simulator/view.hpp"

namespace striper::detail {
namespace {

constexpr int kSamples = 64;  // Of a pixel on an edge.

/// Shares of the lens blur among whole pixels, symmetric, the centre first; its variance is that of
/// the blur.
std::vector<double> blur_shares(double sigma_px) {
  if (sigma_px <= 0.0) return {1.0};
  if (sigma_px < 0.5) return {1.0 - sigma_px * sigma_px, 0.5 * sigma_px * sigma_px};
  std::vector<double> shares;
  double sum = 0.0;
  for (int i = 0; i <= std::ceil(5.0 * sigma_px); ++i) {
    shares.push_back(std::exp(-0.5 * i * i / (sigma_px * sigma_px)));
    sum += i == 0 ? shares.back() : 2.0 * shares.back();
  }
  for (double& share : shares) share /= sum;
  return shares;
}

/// Convolves every row, and writes the picture transposed, so that twice is both axes. Beyond the
/// border the picture goes on as it ends.
cv::Mat blurred_rows_transposed(const cv::Mat& image, const std::vector<double>& shares) {
  cv::Mat result(image.cols, image.rows, CV_32FC1);
  const int reach = static_cast<int>(shares.size()) - 1;
  for (int row = 0; row < image.rows; ++row) {
    const auto* const from = image.ptr<float>(row);
    for (int column = 0; column < image.cols; ++column) {
      double sum = shares[0] * from[column];
      for (int i = 1; i <= reach; ++i) {
        sum += shares[static_cast<std::size_t>(i)] *
               (static_cast<double>(from[std::max(column - i, 0)]) +
                from[std::min(column + i, image.cols - 1)]);
      }
      result.at<float>(column, row) = static_cast<float>(sum);
    }
  }
  return result;
}

}  // namespace

cv::Mat blurred(const cv::Mat& image, double sigma_px) {
  const std::vector<double> shares = blur_shares(sigma_px);
  if (shares.size() == 1) return image;
  return blurred_rows_transposed(blurred_rows_transposed(image, shares), shares);
}

namespace {

/// Tells whether two neighbouring pixels see the same thing in the same light.
struct Seen {
  int facet = -1;
  int patch = 0;
  float electrons = 0.0F;

  bool differs_from(const Seen& other) const noexcept {
    const float larger = std::max(electrons, other.electrons);
    return facet != other.facet || patch != other.patch ||
           std::abs(electrons - other.electrons) > 0.02F * larger;
  }
};

class DaylightPainter {
 public:
  explicit DaylightPainter(const View& view) : view_(view), region_(view.rays().region()) {}

  cv::Mat paint() {
    see_pixels();
    cv::Mat image(region_.height, region_.width, CV_32FC1);
    for (int row = 0; row < region_.height; ++row) {
      for (int column = 0; column < region_.width; ++column) {
        image.at<float>(row, column) =
            is_on_edge(column, row) ? sampled(column, row) : seen(column, row).electrons;
      }
    }
    return blurred(image, view_.scene().imager.blur_sigma_px);
  }

 private:
  const Seen& seen(int column, int row) const noexcept {
    return seen_[static_cast<std::size_t>(row * region_.width + column)];
  }

  void see_pixels() {
    seen_.reserve(static_cast<std::size_t>(region_.area()));
    for (int v = region_.y; v < region_.y + region_.height; ++v) {
      for (int u = region_.x; u < region_.x + region_.width; ++u) {
        const Hit& hit = view_.hit(u, v);
        const Eigen::Vector2d& ray = view_.rays().at(u, v);
        Seen& pixel = seen_.emplace_back();
        if (!ray.allFinite()) continue;
        pixel.facet = hit.facet;
        if (hit.found()) {
          pixel.patch = view_.shading().reflection(hit, hit.t * ray.homogeneous()).patch;
        }
        pixel.electrons =
            static_cast<float>(view_.shading().daylight_electrons(hit, ray.homogeneous()));
      }
    }
  }

  bool is_on_edge(int column, int row) const noexcept {
    const Seen& here = seen(column, row);
    for (int j = std::max(row - 1, 0); j <= std::min(row + 1, region_.height - 1); ++j) {
      for (int i = std::max(column - 1, 0); i <= std::min(column + 1, region_.width - 1); ++i) {
        if (here.differs_from(seen(i, j))) return true;
      }
    }
    return false;
  }

  /// The mean over a pixel of a lattice of points that is even in every direction (Roberts' R2).
  float sampled(int column, int row) const {
    const int u = column + region_.x;
    const int v = row + region_.y;
    double sum = 0.0;
    for (int k = 0; k < kSamples; ++k) {
      const double x = std::fmod(0.5 + 0.75487766624669276 * (k + 1), 1.0) - 0.5;
      const double y = (k + 0.5) / kSamples - 0.5;
      const Eigen::Vector2d ray = view_.rays().interpolate(u + x, v + y);
      if (!ray.allFinite()) continue;
      const Hit hit = view_.cast(u, v, ray.homogeneous());
      sum += view_.shading().daylight_electrons(hit, ray.homogeneous());
    }
    return static_cast<float>(sum / kSamples);
  }

  const View& view_;
  cv::Rect region_;
  std::vector<Seen> seen_;
};

}  // namespace

cv::Mat View::daylight() const { return DaylightPainter(*this).paint(); }

}  // namespace striper::detail
