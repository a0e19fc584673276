// SPDX-License-Identifier: Apache-2.0
#include "ambient/pixels/band_profiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include <opencv2/core.hpp>

#include <striper/core/robust.hpp>

#include "ambient/pixels/line_path.hpp"

namespace striper::detail {
namespace {

constexpr int kBandWidth =
    8;  // Scan lines averaged; a stripe rarely climbs more than a scan line over them.

// Noise alone seldom makes more of a third difference.
constexpr float kEdgeSigmas = 4.0F;

constexpr int kSamples = 2048;  // So many tell the noise.

constexpr int kSideDistance = LinePath::kSide;

// A step of height h has a third difference of 2 h. Interpolated half-way it is wrong by up to h /
// 2, of which smoothing leaves a quarter.
constexpr float kVarianceOfThirdDifference = 1.0F / 192.0F;

// `any_channels` and `any_width` are perhaps known when this is compiled.
template <typename Pixel, typename Channels, typename Width>
void average_columns(const cv::Mat& image, Channels any_channels, int first, Width any_width,
                     float* profile) {
  const int channels = any_channels;
  const int width = any_width;
  const float per_width = 1.0F / static_cast<float>(width);
  for (int row = 0; row < image.rows; ++row) {
    const auto* const pixels = image.ptr<Pixel>(row) + first;
    int sum = 0;
    for (int i = 0; i < width; ++i) sum += pixels[i * channels];
    profile[row] = static_cast<float>(sum) * per_width;
  }
}

template <typename Pixel>
void average_columns_of(const cv::Mat& image, int channels, int first, int width, float* profile) {
  if (channels == 1 && width == kBandWidth) {
    using Grey = std::integral_constant<int, 1>;
    using WholeBand = std::integral_constant<int, kBandWidth>;
    average_columns<Pixel>(image, Grey(), first, WholeBand(), profile);
  } else {
    average_columns<Pixel>(image, channels, first, width, profile);
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

// The bands of an image: groups of neighbouring scan lines, spread over it.
struct Bands {
  int lines;
  int width;
  int count;

  Bands(const cv::Mat& image, StripeAxis axis, int most)
      : lines(axis == StripeAxis::kColumns ? image.cols : image.rows),
        width(std::min(kBandWidth, lines)),
        count(std::min(most, lines / width)) {}

  int first_line(int band) const {
    return static_cast<int>(static_cast<std::int64_t>(lines - width) * band /
                            std::max(1, count - 1));
  }
};

template <typename Pixel>
void average_bands(const cv::Mat& image, StripeAxis axis, const Bands& bands, cv::Mat& profiles) {
  const bool columns = axis == StripeAxis::kColumns;
  const int channels = image.channels();
  const int width = bands.width;
  profiles.create(bands.count * channels, columns ? image.rows : image.cols, CV_32F);
  for (int channel = 0; channel < channels; ++channel) {
    for (int band = 0; band < bands.count; ++band) {
      const int line = bands.first_line(band);
      auto* const profile = profiles.ptr<float>(channel * bands.count + band);
      if (columns) {
        average_columns_of<Pixel>(image, channels, line * channels + channel, width, profile);
      } else {
        average_rows<Pixel>(image, channels, line * channels + channel, width, profile);
      }
    }
  }
}

// Of each band its middle scan line.
void sample_bands(const cv::Mat& values, StripeAxis axis, const Bands& bands, cv::Mat& samples) {
  const bool columns = axis == StripeAxis::kColumns;
  samples.create(bands.count, columns ? values.rows : values.cols, CV_32F);
  for (int band = 0; band < bands.count; ++band) {
    const int line = bands.first_line(band) + bands.width / 2;
    auto* const out = samples.ptr<float>(band);
    for (int k = 0; k < samples.cols; ++k) {
      out[k] = columns ? values.ptr<float>(k)[line] : values.ptr<float>(line)[k];
    }
  }
}

float sample(const float* row, int length, int k) { return row[std::clamp(k, 0, length - 1)]; }

// Images without any noise still have rounding.
float sigma_above_rounding(std::vector<float>& absolute_values) {
  return std::max(0.1F, static_cast<float>(robust_sigma(absolute_values)));
}

// One sigma of a sample of the values; the stripe and edges are few and do not move a median.
float sigma_of(const cv::Mat& values, std::vector<float>& scratch) {
  const int stride = std::max(1, values.rows * values.cols / kSamples) | 1;
  scratch.clear();
  for (int i = 0; i < values.rows * values.cols; i += stride) {
    scratch.push_back(std::abs(values.ptr<float>(i / values.cols)[i % values.cols]));
  }
  return sigma_above_rounding(scratch);
}

// Each row through a symmetric filter.
template <std::size_t kTaps>
void filter(const cv::Mat& profiles, const std::array<float, kTaps>& taps, cv::Mat& out) {
  constexpr int kReach = static_cast<int>(kTaps / 2);
  out.create(profiles.size(), CV_32F);
  const int n = profiles.cols;
  for (int band = 0; band < profiles.rows; ++band) {
    const auto* const in = profiles.ptr<float>(band);
    auto* const values = out.ptr<float>(band);
    const auto filter_at = [&](int k, const auto& at) {
      float value = 0.0F;
      for (int i = -kReach; i <= kReach; ++i) {
        value += taps[static_cast<std::size_t>(i + kReach)] * at(k + i);
      }
      values[k] = value;
    };
    const auto inside = [in](int k) { return in[k]; };
    const auto at_border = [in, n](int k) { return sample(in, n, k); };
    const int first = std::min(kReach, n);
    const int last = std::max(first, n - kReach);
    for (int k = 0; k < first; ++k) filter_at(k, at_border);
    for (int k = first; k < last; ++k) filter_at(k, inside);
    for (int k = last; k < n; ++k) filter_at(k, at_border);
  }
}

void smooth(BandProfiles& profiles) {
  // A Gaussian of 1.3 samples, and the mean of five.
  constexpr std::array<float, 7> kSmooth{0.0214F, 0.0940F, 0.2284F, 0.3124F,
                                         0.2284F, 0.0940F, 0.0214F};
  constexpr std::array<float, 5> kSide{0.2F, 0.2F, 0.2F, 0.2F, 0.2F};
  filter(profiles.plain, kSmooth, profiles.smooth);
  filter(profiles.plain, kSide, profiles.side);
}

}  // namespace

// cv::Mat::setTo allocates.
void set_to_zero(cv::Mat& values) {
  for (int row = 0; row < values.rows; ++row) {
    std::fill_n(values.ptr<float>(row), values.cols, 0.0F);
  }
}

void LineSearch::average(const cv::Mat& image, StripeAxis axis, cv::Mat& profiles) const {
  const Bands bands(image, axis, most_bands_);
  if (image.depth() == CV_8U) {
    average_bands<std::uint8_t>(image, axis, bands, profiles);
  } else {
    average_bands<std::uint16_t>(image, axis, bands, profiles);
  }
}

void LineSearch::profile(const Frame& exposure, StripeAxis axis, BandProfiles& profiles) {
  average(exposure.image, axis, profiles.plain);
  const bool is_field = axis == StripeAxis::kColumns && exposure.field != Field::kProgressive;
  if (is_field) shift_by_quarter(profiles.plain, exposure.field == Field::kBottom ? -1 : 1);
  smooth(profiles);
  if (is_field) {
    find_interpolation_variance(profiles.plain, profiles.interpolation_variance);
  } else {
    profiles.interpolation_variance.release();
  }
}

void LineSearch::profile(const cv::Mat& image, const cv::Mat& variance, StripeAxis axis,
                         BandProfiles& profiles) {
  average(image, axis, profiles.plain);
  smooth(profiles);
  if (variance.empty()) {
    profiles.interpolation_variance.release();
  } else {
    sample_bands(variance, axis, Bands(image, axis, most_bands_), profiles.interpolation_variance);
  }
}

// A quarter of a sample later or earlier, by cubic convolution (Keys 1981): both fields are moved
// to the row half-way between them, so that both lose the same detail.
void LineSearch::shift_by_quarter(cv::Mat& profiles, int direction) {
  constexpr std::array<float, 4> kTaps{-0.0703125F, 0.8671875F, 0.2265625F, -0.0234375F};
  values_.resize(static_cast<std::size_t>(profiles.cols));
  for (int band = 0; band < profiles.rows; ++band) {
    auto* const row = profiles.ptr<float>(band);
    for (int k = 0; k < profiles.cols; ++k) {
      float value = 0.0F;
      for (int i = 0; i < 4; ++i) {
        value += kTaps[static_cast<std::size_t>(i)] *
                 sample(row, profiles.cols, k + direction * (i - 1));
      }
      values_[static_cast<std::size_t>(k)] = value;
    }
    std::copy(values_.begin(), values_.end(), row);
  }
}

void LineSearch::find_interpolation_variance(const cv::Mat& profiles, cv::Mat& variances) {
  differences_.create(profiles.size(), CV_32F);
  const int n = profiles.cols;
  for (int band = 0; band < profiles.rows; ++band) {
    const auto* const in = profiles.ptr<float>(band);
    auto* const out = differences_.ptr<float>(band);
    for (int k = 0; k < n; ++k) {
      out[k] = sample(in, n, k + 1) - sample(in, n, k - 2) +
               3.0F * (sample(in, n, k - 1) - sample(in, n, k));
    }
  }
  // What noise makes of it is no edge.
  const float least = kEdgeSigmas * sigma_of(differences_, values_);
  variances.create(profiles.size(), CV_32F);
  set_to_zero(variances);
  for (int band = 0; band < profiles.rows; ++band) {
    const auto* const in = differences_.ptr<float>(band);
    auto* const out = variances.ptr<float>(band);
    for (int k = 0; k < n; ++k) {
      if (std::abs(in[k]) < least) continue;
      const float variance = kVarianceOfThirdDifference * in[k] * in[k];
      for (int i = std::max(0, k - 2); i <= std::min(n - 1, k + 2); ++i) {
        out[i] = std::max(out[i], variance);
      }
    }
  }
}

float LineSearch::noise_of(const BandProfiles& a, const BandProfiles& b) {
  const int length = std::min(a.plain.cols, b.plain.cols);
  const int inside = length - 2 * kSideDistance;
  if (inside <= 0) return 1.0F;
  const int count = a.plain.rows * inside;
  const int stride = std::max(1, count / kSamples) | 1;
  values_.clear();
  for (int i = 0; i < count; i += stride) {
    const int band = i / inside;
    const int k = i % inside + kSideDistance;
    const auto difference = [band](const cv::Mat& p, const cv::Mat& q, int at) {
      return p.ptr<float>(band)[at] - q.ptr<float>(band)[at];
    };
    const float sides = 0.5F * (difference(a.side, b.side, k - kSideDistance) +
                                difference(a.side, b.side, k + kSideDistance));
    values_.push_back(std::abs(difference(a.smooth, b.smooth, k) - sides));
  }
  return sigma_above_rounding(values_);
}

// How far each place rises above both of its sides in `over - under`, in sigmas. A dark
// stripe has bright sides only where one of them is dark, so it does not count as two bright ones.
void LineSearch::fold_heights(const ProfilePair& pair, int band, int length, int fold,
                              std::span<float> heights) {
  const auto row = [band](const cv::Mat& profiles) { return profiles.ptr<float>(band); };
  const bool has_variance = pair.interpolated && !pair.under.interpolation_variance.empty();
  const BandHeights unfolded{row(pair.over.smooth),
                             row(pair.under.smooth),
                             row(pair.over.side),
                             row(pair.under.side),
                             has_variance ? row(pair.under.interpolation_variance) : nullptr,
                             pair.noise,
                             kSideDistance};
  if (fold == 1) return unfolded.measure(heights);
  unfolded_.resize(static_cast<std::size_t>(length));
  unfolded.measure(unfolded_);
  LinePath::fold(unfolded_, heights);
}

double LineSearch::strength(std::span<const ProfilePair> pairs, int bands, int most_jump) {
  int length = pairs.front().over.plain.cols;
  for (const ProfilePair& pair : pairs) {
    length = std::min({length, pair.over.plain.cols, pair.under.plain.cols});
  }
  const int fold = LinePath::fold_of(length);
  // The stripe shows in one channel of a colour image at least.
  const int rows = pairs.front().over.plain.rows;
  float strongest = 0.0F;
  for (int first = 0; first < rows; first += bands) {
    path_.begin(length, most_jump);
    heights_.resize(static_cast<std::size_t>(path_.places()));
    others_.resize(heights_.size());
    for (int band = first; band < first + bands; ++band) {
      fold_heights(pairs[0], band, length, fold, heights_);
      for (std::size_t n = 1; n < pairs.size(); ++n) {
        fold_heights(pairs[n], band, length, fold, others_);
        for (std::size_t k = 0; k < heights_.size(); ++k) {
          heights_[k] = std::min(heights_[k], others_[k]);
        }
      }
      path_.add(heights_);
    }
    strongest = std::max(strongest, path_.strength());
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

double LineSearch::white_variance_of_difference(const cv::Mat& a, const cv::Mat& b) {
  const int length = std::min(a.cols, b.cols);
  differences_.create(a.rows, length, CV_32F);
  set_to_zero(differences_);
  for (int band = 0; band < a.rows; ++band) {
    const auto* const p = a.ptr<float>(band);
    const auto* const q = b.ptr<float>(band);
    auto* const out = differences_.ptr<float>(band);
    for (int k = 1; k + 1 < length; ++k) {
      out[k] = p[k - 1] - q[k - 1] - 2.0F * (p[k] - q[k]) + p[k + 1] - q[k + 1];
    }
  }
  const double sigma = sigma_of(differences_, values_);
  return sigma * sigma / 6.0;
}

}  // namespace striper::detail
