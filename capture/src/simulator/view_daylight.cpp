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

// Rays of a pixel on an edge of a texture (a checkerboard's corners must be exact), of a surface,
// of light and shade.
constexpr int kTextureSamples = 64;
constexpr int kSurfaceSamples = 16;
constexpr int kShadeSamples = 4;
constexpr float kSmooth = 0.05F;  // Neighbours that differ by less are no edge.

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
/// border the picture goes on as it ends. Share by share along a whole row: so the compiler can use
/// vectors without changing the order of a pixel's sum.
cv::Mat blurred_rows_transposed(const cv::Mat& image, const std::vector<double>& shares) {
  cv::Mat result(image.cols, image.rows, CV_32FC1);
  const std::size_t reach = shares.size() - 1;
  const auto width = static_cast<std::size_t>(image.cols);
  std::vector<double> padded(width + 2 * reach);
  std::vector<double> sums(width);
  for (int row = 0; row < image.rows; ++row) {
    const auto* const from = image.ptr<float>(row);
    const auto middle = padded.begin() + static_cast<std::ptrdiff_t>(reach);
    std::fill(padded.begin(), middle, from[0]);
    std::fill(std::copy(from, from + width, middle), padded.end(), from[width - 1]);
    for (std::size_t k = 0; k < width; ++k) sums[k] = shares[0] * padded[k + reach];
    for (std::size_t i = 1; i <= reach; ++i) {
      const double share = shares[i];
      const double* const before = &padded[reach - i];
      const double* const after = &padded[reach + i];
      for (std::size_t k = 0; k < width; ++k) sums[k] += share * (before[k] + after[k]);
    }
    for (std::size_t k = 0; k < width; ++k) {
      result.at<float>(static_cast<int>(k), row) = static_cast<float>(sums[k]);
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

/// What a pixel's centre sees.
struct Seen {
  int facet = -1;
  int patch = 0;
  float electrons = 0.0F;

  /// How many rays a pixel needs whose neighbour is another: 1 where both see the same.
  int samples_beside(const Seen& other) const noexcept {
    if (facet != other.facet) return kSurfaceSamples;
    if (patch != other.patch) return kTextureSamples;
    const float difference = std::abs(electrons - other.electrons);
    return difference > kSmooth * std::max(electrons, other.electrons) ? kShadeSamples : 1;
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
        const int samples = samples_needed(column, row);
        image.at<float>(row, column) =
            samples > 1 ? sampled(column, row, samples) : seen(column, row).electrons;
      }
    }
    return blurred(image, view_.scene().imager.blur_sigma_px);
  }

 private:
  const Seen& seen(int column, int row) const noexcept {
    const int index = row * region_.width + column;
    return seen_[static_cast<std::size_t>(index)];
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
        const Eigen::Vector3d direction = ray.homogeneous();
        const Reflection spot =
            hit.found() ? view_.shading().reflection(hit, hit.t * direction) : Reflection{};
        pixel.patch = spot.patch;
        pixel.electrons =
            static_cast<float>(view_.shading().daylight_electrons(hit, direction, spot));
      }
    }
  }

  int samples_needed(int column, int row) const noexcept {
    const Seen& here = seen(column, row);
    int samples = 1;
    for (int j = std::max(row - 1, 0); j <= std::min(row + 1, region_.height - 1); ++j) {
      for (int i = std::max(column - 1, 0); i <= std::min(column + 1, region_.width - 1); ++i) {
        samples = std::max(samples, here.samples_beside(seen(i, j)));
      }
    }
    return samples;
  }

  /// The mean over a pixel of a lattice of points, each in a row and a column of its own, so that
  /// an edge along either axis is right to half a sample (a rank-1 lattice, Korobov 1959).
  float sampled(int column, int row, int samples) const {
    const int u = column + region_.x;
    const int v = row + region_.y;
    const int generator = samples == kTextureSamples ? 39 : samples == kSurfaceSamples ? 7 : 3;
    double sum = 0.0;
    for (int k = 0; k < samples; ++k) {
      const double x = (k * generator % samples + 0.5) / samples - 0.5;
      const double y = (k + 0.5) / samples - 0.5;
      const Eigen::Vector2d ray = view_.rays().interpolate(u + x, v + y);
      if (!ray.allFinite()) continue;
      const Hit hit = view_.cast(u, v, ray.homogeneous());
      sum += view_.shading().daylight_electrons(hit, ray.homogeneous());
    }
    return static_cast<float>(sum / samples);
  }

  const View& view_;
  cv::Rect region_;
  std::vector<Seen> seen_;
};

}  // namespace

cv::Mat View::daylight() const { return DaylightPainter(*this).paint(); }

}  // namespace striper::detail
