// SPDX-License-Identifier: Apache-2.0
// The image that daylight and light sources make: one ray a pixel, more where the image has an
// edge.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "light/gaussian_integral.hpp"
#include "view/view.hpp"

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

/// Convolves every row, and writes the image transposed, so that twice is both axes. Beyond the
/// border the image goes on as it ends. Share by share along a whole row: so the compiler can use
/// vectors without changing the order of a pixel's sum. What is dark around is left out: a stripe
/// is a small part of an image.
cv::Mat blurred_rows_transposed(const cv::Mat& image, const std::vector<double>& shares) {
  cv::Mat result(image.cols, image.rows, CV_32FC1, cv::Scalar(0.0));
  const std::size_t reach = shares.size() - 1;
  const auto width = static_cast<std::size_t>(image.cols);
  std::vector<double> padded(width + 2 * reach);
  std::vector<double> sums(width);
  const auto is_lit = [](float electrons) { return electrons != 0.0F; };
  for (int row = 0; row < image.rows; ++row) {
    const auto* const from = image.ptr<float>(row);
    const auto first_lit =
        static_cast<std::size_t>(std::find_if(from, from + width, is_lit) - from);
    if (first_lit == width) continue;
    std::size_t end_lit = width;
    while (!is_lit(from[end_lit - 1])) --end_lit;
    const std::size_t begin = first_lit - std::min(first_lit, reach);
    const std::size_t end = std::min(end_lit + reach, width);

    const auto middle = padded.begin() + static_cast<std::ptrdiff_t>(reach);
    std::fill(padded.begin(), middle, from[0]);
    std::fill(std::copy(from, from + width, middle), padded.end(), from[width - 1]);
    for (std::size_t k = begin; k < end; ++k) sums[k] = shares[0] * padded[k + reach];
    for (std::size_t i = 1; i <= reach; ++i) {
      const double share = shares[i];
      const double* const before = &padded[reach - i];
      const double* const after = &padded[reach + i];
      for (std::size_t k = begin; k < end; ++k) sums[k] += share * (before[k] + after[k]);
    }
    for (std::size_t k = begin; k < end; ++k) {
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

  bool is_same_piece_as(const Seen& other) const noexcept {
    return facet == other.facet && patch == other.patch;
  }

  /// How many rays a pixel needs whose neighbour is another: 1 where both see the same.
  int samples_beside(const Seen& other) const noexcept {
    if (facet != other.facet) return kSurfaceSamples;
    if (patch != other.patch) return kTextureSamples;
    const float difference = std::abs(electrons - other.electrons);
    return difference > kSmooth * std::max(electrons, other.electrons) ? kShadeSamples : 1;
  }
};

/// What a pixel and its neighbours to the left and right see.
struct Row3 {
  float darkest = 0.0F;
  float brightest = 0.0F;
  bool is_one_piece = false;
};

/// A lattice of points in a pixel, each in a row and a column of its own, so that an edge along
/// either axis is right to half a sample (a rank-1 lattice, Korobov 1959).
std::vector<RayPlace> lattice(int samples) {
  const int generator = samples == kTextureSamples ? 39 : samples == kSurfaceSamples ? 7 : 3;
  std::vector<RayPlace> places;
  places.reserve(static_cast<std::size_t>(samples));
  for (int k = 0; k < samples; ++k) {
    places.emplace_back((k * generator % samples + 0.5) / samples - 0.5, (k + 0.5) / samples - 0.5);
  }
  return places;
}

class DaylightPainter {
 public:
  explicit DaylightPainter(const View& view) : view_(view), region_(view.rays().region()) {}

  cv::Mat paint() {
    see_pixels();
    compare_across();
    cv::Mat image(region_.height, region_.width, CV_32FC1);
    for (int row = 0; row < region_.height; ++row) {
      auto* const pixels = image.ptr<float>(row);
      for (int column = 0; column < region_.width; ++column) {
        const int samples = is_smooth(column, row) ? 1 : samples_needed(column, row);
        pixels[column] =
            samples > 1 ? sampled(column, row, lattice_of(samples)) : seen(column, row).electrons;
      }
    }
    return blurred(image, view_.scene().imager.blur_sigma_px);
  }

 private:
  std::size_t index(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(region_.width) +
           static_cast<std::size_t>(column);
  }
  const Seen& seen(int column, int row) const noexcept { return seen_[index(column, row)]; }

  double daylight(int u, int v, const Hit& hit, const Eigen::Vector3d& ray,
                  const Reflection& spot) const noexcept {
    return view_.shading().daylight_electrons(hit, ray, spot, view_.casters(u, v, hit));
  }
  Reflection reflection(const Hit& hit, const Eigen::Vector3d& ray) const noexcept {
    return hit.found() ? view_.shading().reflection(hit, hit.t * ray) : Reflection{};
  }

  void see_pixels() {
    seen_.reserve(static_cast<std::size_t>(region_.area()));
    for (int v = region_.y; v < region_.y + region_.height; ++v) {
      for (int u = region_.x; u < region_.x + region_.width; ++u) {
        const Hit& hit = view_.hit(u, v);
        const Eigen::Vector2d& ray = view_.rays().at(u, v);
        Seen& pixel = seen_.emplace_back();
        if (!ray.allFinite()) continue;
        const Eigen::Vector3d direction = ray.homogeneous();
        const Reflection spot = reflection(hit, direction);
        pixel.facet = hit.facet;
        pixel.patch = spot.patch;
        pixel.electrons = static_cast<float>(daylight(u, v, hit, direction, spot));
      }
    }
  }

  void compare_across() {
    across_.reserve(seen_.size());
    for (int row = 0; row < region_.height; ++row) {
      for (int column = 0; column < region_.width; ++column) {
        const Seen& left = seen(std::max(column - 1, 0), row);
        const Seen& here = seen(column, row);
        const Seen& right = seen(std::min(column + 1, region_.width - 1), row);
        across_.push_back({std::min({left.electrons, here.electrons, right.electrons}),
                           std::max({left.electrons, here.electrons, right.electrons}),
                           here.is_same_piece_as(left) && here.is_same_piece_as(right)});
      }
    }
  }

  /// Whether one sample is enough, judged by the darkest and the brightest of a pixel and
  /// its neighbours: so it is nearly everywhere.
  bool is_smooth(int column, int row) const noexcept {
    const int above = std::max(row - 1, 0);
    const int below = std::min(row + 1, region_.height - 1);
    const Row3& a = across_[index(column, above)];
    const Row3& b = across_[index(column, row)];
    const Row3& c = across_[index(column, below)];
    const float darkest = std::min({a.darkest, b.darkest, c.darkest});
    const float brightest = std::max({a.brightest, b.brightest, c.brightest});
    const Seen& here = seen(column, row);
    return brightest - darkest <= kSmooth * darkest && a.is_one_piece && b.is_one_piece &&
           c.is_one_piece && here.is_same_piece_as(seen(column, above)) &&
           here.is_same_piece_as(seen(column, below));
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

  const std::vector<RayPlace>& lattice_of(int samples) const noexcept {
    return samples == kTextureSamples   ? texture_lattice_
           : samples == kSurfaceSamples ? surface_lattice_
                                        : shade_lattice_;
  }

  /// The mean over a pixel.
  float sampled(int column, int row, const std::vector<RayPlace>& places) const {
    const int u = column + region_.x;
    const int v = row + region_.y;
    double sum = 0.0;
    for (const RayPlace& place : places) {
      const Eigen::Vector2d ray = view_.rays().interpolate(u, v, place);
      if (!ray.allFinite()) continue;
      const Eigen::Vector3d direction = ray.homogeneous();
      const Hit hit = view_.cast(u, v, direction);
      sum += daylight(u, v, hit, direction, reflection(hit, direction));
    }
    return static_cast<float>(sum / static_cast<double>(places.size()));
  }

  const View& view_;
  cv::Rect region_;
  std::vector<RayPlace> texture_lattice_ = lattice(kTextureSamples);
  std::vector<RayPlace> surface_lattice_ = lattice(kSurfaceSamples);
  std::vector<RayPlace> shade_lattice_ = lattice(kShadeSamples);
  std::vector<Seen> seen_;
  std::vector<Row3> across_;
};

}  // namespace

cv::Mat View::daylight() const { return DaylightPainter(*this).paint(); }

}  // namespace striper::detail
