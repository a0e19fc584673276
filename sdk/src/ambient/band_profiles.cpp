// SPDX-License-Identifier: Apache-2.0
#include "ambient/band_profiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include <striper/core/robust.hpp>

#include "ambient/line_path.hpp"

namespace striper::detail {
namespace {

constexpr int kMostBands = 96;
constexpr int kBandWidth = 8;  // Lines averaged; a stripe rarely climbs more than a line over them.

// Noise alone seldom makes more of a third difference.
constexpr float kEdgeSigmas = 4.0F;

constexpr int kSideDistance = LinePath::kSide;

// A step of height h has a third difference of 2 h. Interpolated half-way it is wrong by up to h /
// 2, of which smoothing leaves a quarter.
constexpr float kVarianceOfThirdDifference = 1.0F / 192.0F;

template <typename Pixel>
void average_columns(const cv::Mat& image, int channels, int first, int width, float* profile) {
  for (int row = 0; row < image.rows; ++row) {
    const auto* const pixels = image.ptr<Pixel>(row);
    int sum = 0;
    for (int i = 0; i < width; ++i) sum += pixels[first + i * channels];
    profile[row] = static_cast<float>(sum) / static_cast<float>(width);
  }
}

template <typename Pixel>
void average_rows(const cv::Mat& image, int channels, int first, int width, float* profile) {
  const int row = first / channels;
  const int channel = first % channels;
  for (int col = 0; col < image.cols; ++col) {
    int sum = 0;
    for (int i = 0; i < width; ++i) sum += image.ptr<Pixel>(row + i)[col * channels + channel];
    profile[col] = static_cast<float>(sum) / static_cast<float>(width);
  }
}

template <typename Pixel>
cv::Mat averages(const cv::Mat& image, StripeAxis axis) {
  const bool columns = axis == StripeAxis::kColumns;
  const int channels = image.channels();
  const int lines = columns ? image.cols : image.rows;
  const int length = columns ? image.rows : image.cols;
  const int width = std::min(kBandWidth, lines);
  const int bands = std::min(kMostBands, lines / width);
  cv::Mat profiles(bands * channels, length, CV_32F);
  for (int channel = 0; channel < channels; ++channel) {
    for (int band = 0; band < bands; ++band) {
      const int line = static_cast<int>(static_cast<std::int64_t>(lines - width) * band /
                                        std::max(1, bands - 1));
      auto* const profile = profiles.ptr<float>(channel * bands + band);
      if (columns) {
        average_columns<Pixel>(image, channels, line * channels + channel, width, profile);
      } else {
        average_rows<Pixel>(image, channels, line * channels + channel, width, profile);
      }
    }
  }
  return profiles;
}

float sample(const float* row, int length, int k) { return row[std::clamp(k, 0, length - 1)]; }

// A quarter of a sample later or earlier, by cubic convolution (Keys 1981): both fields are moved
// to the line half-way between them, so that both lose the same detail.
void shift_by_quarter(cv::Mat& profiles, int direction) {
  constexpr std::array<float, 4> kTaps{-0.0703125F, 0.8671875F, 0.2265625F, -0.0234375F};
  std::vector<float> shifted(static_cast<std::size_t>(profiles.cols));
  for (int band = 0; band < profiles.rows; ++band) {
    auto* const row = profiles.ptr<float>(band);
    for (int k = 0; k < profiles.cols; ++k) {
      float value = 0.0F;
      for (int i = 0; i < 4; ++i) {
        value += kTaps[static_cast<std::size_t>(i)] *
                 sample(row, profiles.cols, k + direction * (i - 1));
      }
      shifted[static_cast<std::size_t>(k)] = value;
    }
    std::copy(shifted.begin(), shifted.end(), row);
  }
}

// A sample of the difference's noise, as one sigma; the line and edges are few and do not move a
// median.
float noise_of_difference(const cv::Mat& a, const cv::Mat& b) {
  std::vector<float> values;
  const int stride = std::max(1, a.rows * a.cols / 8192) | 1;
  for (int i = 0; i < a.rows * a.cols; i += stride) {
    const int row = i / a.cols;
    const int col = i % a.cols;
    values.push_back(std::abs(a.ptr<float>(row)[col] - b.ptr<float>(row)[col]));
  }
  // Pictures without any noise still have rounding.
  return std::max(0.1F, static_cast<float>(robust_sigma(values)));
}

// The noise of a height, as one sigma; the line and edges are few and do not move a median.
float noise_of_heights(const BandProfiles& over, const BandProfiles& under, int length) {
  std::vector<float> values;
  const int inside = length - 2 * kSideDistance;
  if (inside <= 0) return 1.0F;
  const int count = over.plain.rows * inside;
  const int stride = std::max(1, count / 8192) | 1;
  for (int i = 0; i < count; i += stride) {
    const int band = i / inside;
    const int k = i % inside + kSideDistance;
    const auto difference = [&](const cv::Mat& a, const cv::Mat& b, int at) {
      return a.ptr<float>(band)[at] - b.ptr<float>(band)[at];
    };
    const float sides = 0.5F * (difference(over.side, under.side, k - kSideDistance) +
                                difference(over.side, under.side, k + kSideDistance));
    values.push_back(std::abs(difference(over.smooth, under.smooth, k) - sides));
  }
  // Pictures without any noise still have rounding.
  return std::max(0.1F, static_cast<float>(robust_sigma(values)));
}

// How far each place rises above both of its sides in `over - under`, in sigmas. A dark
// line has bright sides only where one of them is dark, so it does not count as two bright ones.
void fold_heights(const ProfilePair& pair, int band, int length, int fold, float noise,
                  std::span<float> heights) {
  const auto& [over, under, interpolated] = pair;
  const auto* const a = over.smooth.ptr<float>(band);
  const auto* const b = under.smooth.ptr<float>(band);
  const auto* const a_side = over.side.ptr<float>(band);
  const auto* const b_side = under.side.ptr<float>(band);
  const bool has_variance = interpolated && !under.interpolation_variance.empty();
  const auto* const variance =
      has_variance ? under.interpolation_variance.ptr<float>(band) : nullptr;
  for (int k = 0; k < length; k += fold) {
    float highest = LinePath::kGap;
    for (int i = k; i < std::min(length, k + fold); ++i) {
      const int before = std::max(0, i - kSideDistance);
      const int after = std::min(length - 1, i + kSideDistance);
      const float sides = std::max(a_side[before] - b_side[before], a_side[after] - b_side[after]);
      const float extra = variance != nullptr ? variance[i] : 0.0F;
      highest = std::max(highest, (a[i] - b[i] - sides) / std::sqrt(noise * noise + extra));
    }
    heights[static_cast<std::size_t>(k / fold)] = highest;
  }
}

}  // namespace

cv::Mat band_profiles(const Frame& exposure, StripeAxis axis) {
  const cv::Mat& image = exposure.image;
  cv::Mat profiles = image.depth() == CV_8U ? averages<std::uint8_t>(image, axis)
                                            : averages<std::uint16_t>(image, axis);
  if (axis == StripeAxis::kColumns && exposure.field == Field::kTop) shift_by_quarter(profiles, 1);
  if (axis == StripeAxis::kColumns && exposure.field == Field::kBottom) {
    shift_by_quarter(profiles, -1);
  }
  return profiles;
}

namespace {

// Each row through a symmetric filter.
cv::Mat filtered(const cv::Mat& profiles, std::span<const float> taps) {
  const int reach = static_cast<int>(taps.size() / 2);
  cv::Mat out(profiles.size(), CV_32F);
  for (int band = 0; band < profiles.rows; ++band) {
    const auto* const in = profiles.ptr<float>(band);
    auto* const values = out.ptr<float>(band);
    for (int k = 0; k < profiles.cols; ++k) {
      float value = 0.0F;
      for (int i = -reach; i <= reach; ++i) {
        value += taps[static_cast<std::size_t>(i + reach)] * sample(in, profiles.cols, k + i);
      }
      values[k] = value;
    }
  }
  return out;
}

cv::Mat interpolation_variance(const cv::Mat& profiles) {
  cv::Mat third(profiles.size(), CV_32F);
  const int n = profiles.cols;
  for (int band = 0; band < profiles.rows; ++band) {
    const auto* const in = profiles.ptr<float>(band);
    auto* const out = third.ptr<float>(band);
    for (int k = 0; k < n; ++k) {
      out[k] = sample(in, n, k + 1) - sample(in, n, k - 2) +
               3.0F * (sample(in, n, k - 1) - sample(in, n, k));
    }
  }
  // What noise makes of it is no edge.
  const float least =
      kEdgeSigmas * noise_of_difference(third, cv::Mat::zeros(third.size(), CV_32F));
  cv::Mat variances = cv::Mat::zeros(profiles.size(), CV_32F);
  for (int band = 0; band < profiles.rows; ++band) {
    const auto* const in = third.ptr<float>(band);
    auto* const out = variances.ptr<float>(band);
    for (int k = 0; k < n; ++k) {
      if (std::abs(in[k]) < least) continue;
      const float variance = kVarianceOfThirdDifference * in[k] * in[k];
      for (int i = std::max(0, k - 2); i <= std::min(n - 1, k + 2); ++i) {
        out[i] = std::max(out[i], variance);
      }
    }
  }
  return variances;
}

}  // namespace

BandProfiles filter_profiles(const cv::Mat& plain, bool is_field) {
  // A Gaussian of 1.3 samples, and the mean of five.
  constexpr std::array<float, 7> kSmooth{0.0214F, 0.0940F, 0.2284F, 0.3124F,
                                         0.2284F, 0.0940F, 0.0214F};
  constexpr std::array<float, 5> kSide{0.2F, 0.2F, 0.2F, 0.2F, 0.2F};
  BandProfiles profiles;
  profiles.plain = plain;
  profiles.smooth = filtered(plain, kSmooth);
  profiles.side = filtered(plain, kSide);
  if (is_field) profiles.interpolation_variance = interpolation_variance(plain);
  return profiles;
}

double line_strength(std::span<const ProfilePair> pairs, int bands, int most_jump) {
  int length = pairs.front().over.plain.cols;
  for (const auto& [over, under, interpolated] : pairs) {
    length = std::min({length, over.plain.cols, under.plain.cols});
  }
  std::vector<float> noises;
  for (const ProfilePair& pair : pairs) {
    noises.push_back(noise_of_heights(pair.over, pair.under, length));
  }
  const int fold = LinePath::fold_of(length);
  LinePath path;
  std::vector<float> heights;
  std::vector<float> others;

  // The line shows in one channel of a colour picture at least.
  const int rows = pairs.front().over.plain.rows;
  float strongest = 0.0F;
  for (int first = 0; first < rows; first += bands) {
    path.begin(length, most_jump);
    heights.resize(static_cast<std::size_t>(path.places()));
    others.resize(heights.size());
    for (int band = first; band < first + bands; ++band) {
      fold_heights(pairs[0], band, length, fold, noises[0], heights);
      for (std::size_t n = 1; n < pairs.size(); ++n) {
        fold_heights(pairs[n], band, length, fold, noises[n], others);
        for (std::size_t k = 0; k < heights.size(); ++k) {
          heights[k] = std::min(heights[k], others[k]);
        }
      }
      path.add(heights);
    }
    strongest = std::max(strongest, path.strength());
  }
  return strongest;
}

double mean_square_difference(const cv::Mat& a, const cv::Mat& b) {
  const int length = std::min(a.cols, b.cols);
  double sum = 0.0;
  for (int band = 0; band < a.rows; ++band) {
    const auto* const p = a.ptr<float>(band);
    const auto* const q = b.ptr<float>(band);
    for (int k = 0; k < length; ++k) sum += static_cast<double>(p[k] - q[k]) * (p[k] - q[k]);
  }
  return sum / (static_cast<double>(a.rows) * length);
}

double white_variance_of_difference(const cv::Mat& a, const cv::Mat& b) {
  const int length = std::min(a.cols, b.cols);
  cv::Mat second = cv::Mat::zeros(a.rows, length, CV_32F);
  for (int band = 0; band < a.rows; ++band) {
    const auto* const p = a.ptr<float>(band);
    const auto* const q = b.ptr<float>(band);
    auto* const out = second.ptr<float>(band);
    for (int k = 1; k + 1 < length; ++k) {
      out[k] = p[k - 1] - q[k - 1] - 2.0F * (p[k] - q[k]) + p[k + 1] - q[k + 1];
    }
  }
  const double sigma = noise_of_difference(second, cv::Mat::zeros(second.size(), CV_32F));
  return sigma * sigma / 6.0;
}

}  // namespace striper::detail
