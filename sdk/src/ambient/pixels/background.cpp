// SPDX-License-Identifier: Apache-2.0
#include "ambient/pixels/background.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include <opencv2/core.hpp>

#include <striper/core/robust.hpp>

#include "core/image_line.hpp"

namespace striper::detail {
namespace {

// Interpolated between rows: a step of height h leaves an error uniform in +- h / 2 and has a third
// difference of 2 h. What noise alone makes of a third difference, below four sigmas, is no edge;
// nor of the mean of those side by side, which tells a weak edge along the rows.
constexpr float kVarianceOfThirdDifference = 1.0F / 48.0F;
constexpr double kEdgeNoiseRatio = 16.0 * 20.0;
constexpr int kAlongEdge = 8;

// The share of an exposure's noise that the 4-tap interpolation keeps: (81 + 81 + 1 + 1) / 256.
constexpr double kTapsNoise = 164.0 / 256.0;
// Of rows one, two and three apart, which share taps: (-1, 9, 9, -1) with itself, shifted.
constexpr std::array<float, 3> kTapsCorrelation{63.0F / 164.0F, -18.0F / 164.0F, 1.0F / 164.0F};

// A block is darker than what stands by so many sigmas, squared, of its mean, and by more than
// rounding makes of that.
constexpr double kDarkerSigmas2 = 25.0;
constexpr double kRoundedMean = 0.3;

template <typename Pixel>
void mix_rows(const Pixel* a, const Pixel* b, double weight_b, Pixel* out, int n) {
  const auto wb = static_cast<std::int32_t>(std::lround(256.0 * weight_b));
  if (wb == 128) {
    for (int i = 0; i < n; ++i) out[i] = static_cast<Pixel>((a[i] + b[i] + 1) >> 1);
    return;
  }
  const std::int32_t wa = 256 - wb;
  for (int i = 0; i < n; ++i) out[i] = static_cast<Pixel>((a[i] * wa + b[i] * wb + 128) >> 8);
}

// The same in sixteenths of a DN.
template <typename Pixel>
void mix_rows_finely(const Pixel* a, const Pixel* b, double weight_b, std::int32_t* out, int n) {
  const auto wb = static_cast<std::int32_t>(std::lround(256.0 * weight_b));
  if (wb == 128) {
    for (int i = 0; i < n; ++i) out[i] = (a[i] + b[i]) << 3;
    return;
  }
  const std::int32_t wa = 256 - wb;
  for (int i = 0; i < n; ++i) out[i] = (a[i] * wa + b[i] * wb) >> 4;
}

}  // namespace

Background::Background(const std::optional<NoiseModel>& noise) : given_noise_(noise) {}

void Background::subtract(const DarkPair& pair, LitFrame& frame) {
  prepare(frame.lit.size());
  if (frame.lit.depth() == CV_8U) {
    subtract_pixels<std::uint8_t>(pair, frame);
  } else {
    subtract_pixels<std::uint16_t>(pair, frame);
  }
}

double Background::subtract_standing(const cv::Mat& standing, float noise_gain, LitFrame& frame) {
  prepare(frame.lit.size());
  DarkPair pair;
  pair.before = &standing;
  if (frame.lit.depth() == CV_8U) {
    read_standing<std::uint8_t>(pair, frame);
  } else {
    read_standing<std::uint16_t>(pair, frame);
  }
  frame.dark = standing;
  frame.dark_noise_gain = noise_gain;
  const bool moves = add_motion(pair, 1.0, frame);
  frame.variance = moves ? variance_ : cv::Mat();
  frame.masked = masked_.find(frame.lit, &standing, nullptr, standing, frame.full_scale_dn);
  return frame.lit.depth() == CV_8U
             ? darker_part<std::uint8_t>(frame.lit, standing, static_cast<double>(noise_gain))
             : darker_part<std::uint16_t>(frame.lit, standing, static_cast<double>(noise_gain));
}

// The noise of an exposure is the lit one's: what stands has less.
template <typename Pixel>
void Background::read_standing(const DarkPair& pair, const LitFrame& frame) {
  read_strips<Pixel>(pair, frame);
  DarkPair exposure;
  exposure.before = &frame.lit;
  take_noise<Pixel>(exposure, frame.full_scale_dn);
}

// Measured, or as it was given: in the DN of these images.
template <typename Pixel>
void Background::take_noise(const DarkPair& pair, int full_scale_dn) {
  if (!given_noise_) return measure_noise<Pixel>(pair, full_scale_dn);
  if (full_scale_dn == noise_full_scale_dn_) return;
  noise_full_scale_dn_ = full_scale_dn;
  const int depth = std::bit_width(static_cast<unsigned>(full_scale_dn));
  const cv::Mat& exposure = pair.any();
  noise_ = given_noise_->at_likely_depth(depth, noise_of_neighbours<Pixel>(exposure, full_scale_dn),
                                         cv::mean(exposure.row(exposure.rows / 2))[0]);
}

// Of the blocks, those darker in the mean than what stands: no stripe makes them so, which is seen
// but where it was long.
template <typename Pixel>
double Background::darker_part(const cv::Mat& lit, const cv::Mat& standing,
                               double noise_gain) const {
  int blocks = 0;
  int darker = 0;
  for (int row = 0; row + Motion::kRows <= lit.rows; row += Motion::kRows) {
    for (int col = 0; col + Motion::kCols <= lit.cols; col += Motion::kCols) {
      std::int64_t sum = 0;
      std::int64_t level = 0;
      for (int r = row; r < row + Motion::kRows; ++r) {
        const auto* const p = lit.ptr<Pixel>(r) + col;
        const auto* const q = standing.ptr<Pixel>(r) + col;
        for (int i = 0; i < Motion::kCols; ++i) {
          sum += p[i] - q[i];
          level += q[i];
        }
      }
      constexpr double kPixels = Motion::kRows * Motion::kCols;
      const double variance =
          (1.0 + noise_gain) * noise_.variance_dn2(static_cast<double>(level) / kPixels) / kPixels;
      ++blocks;
      const double below = -static_cast<double>(sum) / kPixels;
      if (below > kRoundedMean && below * below > kDarkerSigmas2 * variance) ++darker;
    }
  }
  return static_cast<double>(darker) / std::max(1, blocks);
}

void Background::prepare(cv::Size size) {
  motion_.prepare(size);
  masked_.prepare(size);
  if (variance_.size() != size) variance_ = cv::Mat::zeros(size, CV_32F);
}

template <typename Pixel>
void Background::subtract_pixels(const DarkPair& pair, LitFrame& frame) {
  const double wa = pair.weight_after;
  const double averaging = pair.has_both() ? wa * wa + (1.0 - wa) * (1.0 - wa) : 1.0;
  read_strips<Pixel>(pair, frame);
  take_noise<Pixel>(pair, frame.full_scale_dn);
  if (pair.is_between_rows) interpolate_between_rows<Pixel>(pair, averaging, frame.lit.size());

  const bool is_written = pair.is_between_rows || pair.has_both();
  frame.dark = is_written ? dark_ : pair.any();
  frame.dark_noise_gain = static_cast<float>(averaging * (pair.is_between_rows ? kTapsNoise : 1.0));
  frame.dark_noise_correlation = pair.is_between_rows ? kTapsCorrelation : std::array<float, 3>{};
  frame.masked = masked_.find(frame.lit, pair.before, pair.after, frame.dark, frame.full_scale_dn);
  const bool has_motion = add_motion(pair, averaging, frame);
  frame.variance = has_motion || pair.is_between_rows ? variance_ : cv::Mat();
}

// Returns whether there is any.
bool Background::add_motion(const DarkPair& pair, double averaging, const LitFrame& frame) {
  if (!pair.is_between_rows) {
    if (has_edges_) std::memset(variance_.data, 0, variance_.total() * sizeof(float));
    has_edges_ = false;
    motion_.clear(variance_);
  }
  if (!pair.has_both()) {
    motion_.compare_with_lit(frame.lit, frame.dark, has_edges_ ? variance_ : cv::Mat());
    motion_.keep_beyond(noise_, static_cast<double>(frame.dark_noise_gain));
    return motion_.add_to(variance_, 1.0);
  }
  if (!frame.masked.empty()) motion_.leave_out(*pair.before, *pair.after, frame.masked);
  motion_.keep_beyond(noise_, 1.0);
  // Texture that passes by differs between before and after by twice its variance; lit less their
  // mean has what this factor makes of it.
  return motion_.add_to(variance_, 0.5 * (1.0 + averaging));
}

// All that takes every pixel of every image, a strip of rows at a time so that each is read from
// memory once.
template <typename Pixel>
void Background::read_strips(const DarkPair& pair, const LitFrame& frame) {
  const cv::Mat& lit = frame.lit;
  const bool mixes = pair.has_both() && !pair.is_between_rows;
  if (mixes) dark_.create(lit.size(), lit.type());
  for (int strip = 0; strip < motion_.strips(); ++strip) {
    const int first = strip * Motion::kRows;
    const int last = std::min(first + Motion::kRows, lit.rows);
    if (pair.has_both()) motion_.compare_strip(*pair.before, *pair.after, strip);
    for (int row = first; row < last; ++row) {
      if (mixes) {
        mix_rows(pair.before->ptr<Pixel>(row), pair.after->ptr<Pixel>(row), pair.weight_after,
                 dark_.ptr<Pixel>(row), lit.cols);
      }
      const auto is_saturated = [&](const cv::Mat* image) {
        return image != nullptr && row < image->rows &&
               row_maximum(image->ptr<Pixel>(row), lit.cols) >= frame.full_scale_dn;
      };
      masked_.set_row(row, is_saturated(&lit),
                      is_saturated(pair.before) || is_saturated(pair.after));
    }
  }
}

// Where everything moves no block is quiet, and where everything is textured no pixel is like its
// neighbours; seldom both.
template <typename Pixel>
void Background::measure_noise(const DarkPair& pair, int full_scale_dn) {
  double variance = noise_of_neighbours<Pixel>(pair.any(), full_scale_dn);
  if (pair.has_both()) variance = std::min(variance, motion_.noise_of_quietest_blocks());
  if (!std::isfinite(variance)) variance = kRounding_dn2;
  noise_.read_noise_dn = std::sqrt(std::max(0.0, variance - kRounding_dn2));
}

// Fields: the dark rows lie half-way between the lit ones. Writes the whole of variance_ too.
template <typename Pixel>
void Background::interpolate_between_rows(const DarkPair& pair, double averaging, cv::Size size) {
  const cv::Mat& a = pair.any();
  const cv::Mat& b = pair.after != nullptr ? *pair.after : a;
  const auto cols = static_cast<std::size_t>(size.width);
  dark_.create(size, a.type());
  rows_.resize(4 * cols);
  thirds_.assign(3 * (cols + kAlongEdge), 0);
  const auto mixed = [&](int row) {
    return rows_.data() + static_cast<std::size_t>(row & 3) * cols;
  };
  const auto mix = [&](int row) {
    const int inside = std::clamp(row, 0, a.rows - 1);
    mix_rows_finely(a.ptr<Pixel>(inside), b.ptr<Pixel>(inside), pair.weight_after, mixed(row + 4),
                    size.width);
  };
  const double ratio = 256.0 * kEdgeNoiseRatio * averaging;
  const EdgeLimit limit{static_cast<float>(ratio * noise_.variance_dn2(noise_.black_level_dn)),
                        static_cast<float>(ratio * noise_.dn_per_electron / 16.0),
                        static_cast<float>(16.0 * noise_.black_level_dn)};
  constexpr std::int32_t kLargest = std::numeric_limits<Pixel>::max();
  has_edges_ = true;

  for (int row = pair.row_above - 1; row < pair.row_above + 2; ++row) mix(row);
  for (int row = 0; row < size.height; ++row) {
    const int above = row + pair.row_above;
    mix(above + 2);
    const std::int32_t* const m0 = mixed(above + 3);
    const std::int32_t* const m1 = mixed(above + 4);
    const std::int32_t* const m2 = mixed(above + 5);
    const std::int32_t* const m3 = mixed(above + 6);
    auto* const out = dark_.ptr<Pixel>(row);
    std::int32_t* const third = thirds_.data() + kAlongEdge / 2;
    for (int i = 0; i < size.width; ++i) {
      const std::int32_t sum = 9 * (m1[i] + m2[i]) - m0[i] - m3[i];
      out[i] = static_cast<Pixel>(std::clamp((sum + 128) >> 8, 0, kLargest));
      third[i] = m3[i] - m0[i] + 3 * (m1[i] - m2[i]);
    }
    write_edges(limit, m1, variance_.ptr<float>(row), size.width);
  }
}

// The variance that the third differences of a row stand for: each by itself, or the mean of those
// about it. All in 1/16 DN. @param level of the image, which noise grows with.
void Background::write_edges(const EdgeLimit& limit, const std::int32_t* level, float* variance,
                             int cols) {
  constexpr float kScale = kVarianceOfThirdDifference / 256.0F;
  constexpr float kScaleOfSum = kScale / (kAlongEdge * kAlongEdge);
  constexpr int kMiddle = kAlongEdge / 2;
  const std::int32_t* const third = thirds_.data();
  std::int32_t* const of_two = thirds_.data() + cols + kAlongEdge;
  std::int32_t* const of_four = of_two + cols + kAlongEdge;
  for (int i = 0; i < cols + kAlongEdge - 1; ++i) of_two[i] = third[i] + third[i + 1];
  for (int i = 0; i < cols + kAlongEdge - 3; ++i) of_four[i] = of_two[i] + of_two[i + 2];
  for (int i = 0; i < cols; ++i) {
    const auto own = static_cast<float>(third[i + kMiddle]);
    const auto sum = static_cast<float>(of_four[i] + of_four[i + 4]);
    const float light = std::max(0.0F, static_cast<float>(level[i]) - limit.black);
    const float least_square = limit.floor + limit.per_level * light;
    const float own_square = own * own > least_square ? kScale * own * own : 0.0F;
    const float mean_square =
        sum * sum > kAlongEdge * least_square ? kScaleOfSum * sum * sum : 0.0F;
    variance[i] = std::max(own_square, mean_square);
  }
}

// The variance of white noise in one exposure, from how the second differences along and across
// (which planes and edges do not have) scatter about zero. Immerkaer, "Fast noise variance
// estimation" (1996), with a median in place of the mean.
template <typename Pixel>
double Background::noise_of_neighbours(const cv::Mat& image, int full_scale_dn) {
  constexpr int kSamples = 4096;
  sorted_.clear();
  const int rows = image.rows - 2;
  const int cols = image.cols - 2;
  if (rows <= 0 || cols <= 0) return std::numeric_limits<double>::infinity();
  const std::int64_t count = static_cast<std::int64_t>(rows) * cols;
  const std::int64_t stride = std::max<std::int64_t>(1, count / kSamples) | 1;
  for (std::int64_t i = 0; i < count; i += stride) {
    const auto row = static_cast<int>(i / cols);
    const auto col = static_cast<int>(i % cols);
    const Pixel* const a = image.ptr<Pixel>(row) + col;
    const Pixel* const b = image.ptr<Pixel>(row + 1) + col;
    const Pixel* const c = image.ptr<Pixel>(row + 2) + col;
    if (b[1] == 0 || b[1] >= full_scale_dn) continue;  // Clipped: no noise to be seen.
    const int second = a[0] + a[2] + c[0] + c[2] - 2 * (a[1] + b[0] + b[2] + c[1]) + 4 * b[1];
    sorted_.push_back(static_cast<float>(std::abs(second)));
  }
  if (sorted_.empty()) return std::numeric_limits<double>::infinity();
  const double sigma = robust_sigma(sorted_) / 6.0;
  return sigma * sigma;
}

}  // namespace striper::detail
