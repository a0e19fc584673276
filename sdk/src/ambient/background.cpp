// SPDX-License-Identifier: Apache-2.0
#include "ambient/background.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <type_traits>

namespace striper::detail {
namespace {

// Motion is measured in blocks: enough pixels to tell it from noise, small enough to be local.
constexpr int kBlockCols = 16;
constexpr int kBlockRows = 8;

// A block moves if its mean square difference is this many times the noise's: six sigmas of a mean
// of 128 squares.
constexpr double kMotionRatio = 1.75;

// Of blocks that do not move the lowest twentieth, and by how much noise alone is below its mean
// there: 1 - 1.64 sqrt(2 / 128).
constexpr double kStillFraction = 0.05;
constexpr double kStillLevel = 0.79;
constexpr int kPassedBlocks = 8;
constexpr double kRoundingVariance = 1.0 / 12.0;
constexpr std::size_t kMostSampledBlocks = 4096;

// Interpolated between rows: a step of height h leaves an error uniform in +- h / 2 and has a third
// difference of 2 h. What noise alone makes of a third difference, below four sigmas, is no edge;
// nor of the mean of those side by side, which tells a weak edge along the rows.
constexpr float kVarianceOfThirdDifference = 1.0F / 48.0F;
constexpr double kEdgeNoiseRatio = 16.0 * 20.0;
constexpr int kAlongEdge = 8;

// The share of an exposure's noise that the 4-tap interpolation keeps: (81 + 81 + 1 + 1) / 256.
constexpr double kTapsNoise = 164.0 / 256.0;

constexpr int kBlindRows = 4;  // Saturated pixels spoil their neighbours: blooming, lens flare.
constexpr int kBlindCols = 2;
// No stripe is clipped over so many rows.
constexpr int kLongestStripeRun = 15;
// A lamp that moves saturates the lit exposure at most so many blocks from where it did the dark.
constexpr int kLampReachBlocks = 4;

constexpr std::uint8_t kLitSaturated = 1;
constexpr std::uint8_t kDarkSaturated = 2;

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

template <typename Pixel>
Pixel row_maximum(const Pixel* row, int n) {
  Pixel maximum = 0;
  for (int i = 0; i < n; ++i) maximum = std::max(maximum, row[i]);
  return maximum;
}

template <int kCount, typename Pixel>
std::int32_t sum_of(const Pixel* a) {
  std::int32_t sum = 0;
  for (int i = 0; i < kCount; ++i) sum += a[i];
  return sum;
}

template <int kCount, typename Pixel>
float square_difference(const Pixel* a, const Pixel* b) {
  using Sum = std::conditional_t<sizeof(Pixel) == 1, std::int32_t, float>;
  Sum sum = 0;
  for (int i = 0; i < kCount; ++i) {
    const Sum d = static_cast<Sum>(b[i]) - static_cast<Sum>(a[i]);
    sum += d * d;
  }
  return static_cast<float>(sum);
}

}  // namespace

Background::Background(const std::optional<NoiseModel>& noise)
    : noise_(noise.value_or(NoiseModel{})), is_noise_given_(noise.has_value()) {}

void Background::subtract(const DarkPair& pair, LitFrame& frame) {
  prepare(frame.lit);
  if (frame.lit.depth() == CV_8U) {
    subtract_pixels<std::uint8_t>(pair, frame);
  } else {
    subtract_pixels<std::uint16_t>(pair, frame);
  }
}

void Background::prepare(const cv::Mat& lit) {
  const int rows = (lit.rows + kBlockRows - 1) / kBlockRows;
  const int cols = (lit.cols + kBlockCols - 1) / kBlockCols;
  if (rows == block_rows_ && cols == block_cols_ && variance_.size() == lit.size()) return;
  block_rows_ = rows;
  block_cols_ = cols;
  const auto blocks = static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols);
  motion_.assign(blocks, 0.0F);
  levels_.assign(blocks, 0);
  lamps_.assign(blocks, 0);
  has_variance_.assign(blocks, 0);
  run_.assign(static_cast<std::size_t>(lit.cols), 0);
  saturated_.assign(static_cast<std::size_t>(lit.rows), 0);
  sorted_.reserve(2 * kMostSampledBlocks + 2);
  variance_ = cv::Mat::zeros(lit.size(), CV_32F);
  blind_ = cv::Mat::zeros(lit.size(), CV_8U);
  marked_ = cv::Mat::zeros(lit.size(), CV_8U);
  knows_motion_ = false;
}

template <typename Pixel>
void Background::subtract_pixels(const DarkPair& pair, LitFrame& frame) {
  const double wa = pair.weight_after;
  const double averaging = pair.has_both() ? wa * wa + (1.0 - wa) * (1.0 - wa) : 1.0;
  read_strips<Pixel>(pair, frame);
  if (pair.is_between_rows) interpolate_between_rows<Pixel>(pair, averaging, frame.lit.size());

  const bool is_written = pair.is_between_rows || pair.has_both();
  frame.dark = is_written ? dark_ : pair.any();
  frame.dark_noise_gain = static_cast<float>(averaging * (pair.is_between_rows ? kTapsNoise : 1.0));

  // Texture that passes by differs between before and after by twice its variance; lit less their
  // mean has what this factor makes of it. A single dark exposure has it whole.
  const double factor = 0.5 * (1.0 + averaging);
  if (!pair.is_between_rows) clear_motion();
  const bool has_motion = spread_motion(factor);
  frame.variance = has_motion || pair.is_between_rows ? variance_ : cv::Mat();
  frame.blind = mark_blind<Pixel>(pair, frame) ? blind_ : cv::Mat();
}

// All that takes every pixel of every image, a strip of rows at a time so that each is read from
// memory once.
template <typename Pixel>
void Background::read_strips(const DarkPair& pair, const LitFrame& frame) {
  const cv::Mat& lit = frame.lit;
  const bool mixes = pair.has_both() && !pair.is_between_rows;
  const cv::Mat* const second = pair.has_both() ? pair.after : pair.witness;
  if (mixes) dark_.create(lit.size(), lit.type());
  for (int block_row = 0; block_row < block_rows_; ++block_row) {
    const int first = block_row * kBlockRows;
    const int last = std::min(first + kBlockRows, lit.rows);
    if (second != nullptr) measure_motion<Pixel>(pair.any(), *second, block_row);
    for (int row = first; row < last; ++row) {
      if (mixes) {
        mix_rows(pair.before->ptr<Pixel>(row), pair.after->ptr<Pixel>(row), pair.weight_after,
                 dark_.ptr<Pixel>(row), lit.cols);
      }
      const auto is_saturated = [&](const cv::Mat* image) {
        return image != nullptr && row < image->rows &&
               row_maximum(image->ptr<Pixel>(row), lit.cols) >= frame.full_scale_dn;
      };
      auto& flags = saturated_[static_cast<std::size_t>(row)];
      flags = is_saturated(&lit) ? kLitSaturated : 0;
      if (is_saturated(pair.before) || is_saturated(pair.after)) flags |= kDarkSaturated;
    }
  }
  motion_is_of_now_ = second != nullptr;
  if (second == nullptr) return;
  if (!is_noise_given_) {
    // Where everything moves no block is quiet, and where everything is textured no pixel is like
    // its neighbours; seldom both.
    const double spatial = noise_of_neighbours<Pixel>(pair.any(), frame.full_scale_dn);
    const double variance = std::min(0.5 * quietest_blocks(), spatial);
    noise_.read_noise_dn = std::sqrt(std::max(0.0, variance - kRoundingVariance));
  }
  keep_what_noise_does_not_explain(pair.any());
  knows_motion_ = true;
}

// Of each block's mean square difference.
void Background::keep_what_noise_does_not_explain(const cv::Mat& image) {
  for (int row = 0; row < block_rows_; ++row) {
    const int height = std::min(kBlockRows, image.rows - row * kBlockRows);
    for (int col = 0; col < block_cols_; ++col) {
      const auto block = static_cast<std::size_t>(row * block_cols_ + col);
      const int width = std::min(kBlockCols, image.cols - col * kBlockCols);
      const double level = static_cast<double>(levels_[block]) / std::max(1, height * width);
      const auto noise = static_cast<float>(2.0 * noise_.variance_dn2(level));
      float& motion = motion_[block];
      motion = motion > static_cast<float>(kMotionRatio) * noise ? motion - noise : 0.0F;
    }
  }
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
  // Unless it was given, before the first pair only the noise of rounding is known.
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
// about it. All in 1/16 DN. @param level of the picture, which noise grows with.
void Background::write_edges(const EdgeLimit& limit, const std::int32_t* level, float* variance,
                             int cols) {
  constexpr float kScale = kVarianceOfThirdDifference / 256.0F;
  constexpr float kScaleOfSum = kScale / (kAlongEdge * kAlongEdge);
  const std::int32_t* const third = thirds_.data();
  std::int32_t* const of_two = thirds_.data() + cols + kAlongEdge;
  std::int32_t* const of_four = of_two + cols + kAlongEdge;
  for (int i = 0; i < cols + kAlongEdge - 1; ++i) of_two[i] = third[i] + third[i + 1];
  for (int i = 0; i < cols + kAlongEdge - 3; ++i) of_four[i] = of_two[i] + of_two[i + 2];
  for (int i = 0; i < cols; ++i) {
    const auto own = static_cast<float>(third[i + kAlongEdge / 2]);
    const auto sum = static_cast<float>(of_four[i] + of_four[i + 4]);
    const float light = std::max(0.0F, static_cast<float>(level[i]) - limit.black);
    const float least_square = limit.floor + limit.per_level * light;
    const float own_square = own * own > least_square ? kScale * own * own : 0.0F;
    const float mean_square =
        sum * sum > kAlongEdge * least_square ? kScaleOfSum * sum * sum : 0.0F;
    variance[i] = std::max(own_square, mean_square);
  }
}

template <typename Pixel>
void Background::measure_motion(const cv::Mat& before, const cv::Mat& after, int block_row) {
  float* const blocks = motion_.data() + block_row * block_cols_;
  std::int32_t* const levels = levels_.data() + block_row * block_cols_;
  std::fill(blocks, blocks + block_cols_, 0.0F);
  std::fill(levels, levels + block_cols_, 0);
  const int first = block_row * kBlockRows;
  const int last = std::min({first + kBlockRows, before.rows, after.rows});
  const int whole = before.cols / kBlockCols;
  const int rest = before.cols - whole * kBlockCols;
  for (int row = first; row < last; ++row) {
    const auto* const a = before.ptr<Pixel>(row);
    const auto* const b = after.ptr<Pixel>(row);
    for (int i = 0; i < whole; ++i) {
      blocks[i] += square_difference<kBlockCols>(a + i * kBlockCols, b + i * kBlockCols);
      levels[i] += sum_of<kBlockCols>(a + i * kBlockCols);
    }
    for (int i = whole * kBlockCols; i < before.cols; ++i) {
      blocks[whole] += square_difference<1>(a + i, b + i);
      levels[whole] += a[i];
    }
  }
  const auto rows = static_cast<float>(std::max(1, last - first));
  for (int i = 0; i < whole; ++i) blocks[i] /= rows * kBlockCols;
  if (rest > 0) blocks[whole] /= rows * static_cast<float>(rest);
}

// The variance that noise alone gives after - before, from the blocks that differ least.
double Background::quietest_blocks() {
  const std::size_t stride = std::max<std::size_t>(1, motion_.size() / kMostSampledBlocks);
  sorted_.clear();
  for (std::size_t i = 0; i < motion_.size(); i += stride) sorted_.push_back(motion_[i]);
  const auto still =
      static_cast<std::ptrdiff_t>(kStillFraction * static_cast<double>(sorted_.size()));
  std::nth_element(sorted_.begin(), sorted_.begin() + still, sorted_.end());
  return sorted_[static_cast<std::size_t>(still)] / kStillLevel;
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
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  const double sigma = 1.4826 * static_cast<double>(*middle) / 6.0;
  return sigma * sigma;
}

// Takes what the last frame left off variance_.
void Background::clear_motion() {
  if (has_edges_) {
    std::memset(variance_.data, 0, variance_.total() * sizeof(float));
    has_edges_ = false;
  }
  for (int row = 0; row < block_rows_; ++row) {
    for (int col = 0; col < block_cols_; ++col) {
      auto& has_variance = has_variance_[static_cast<std::size_t>(row * block_cols_ + col)];
      if (has_variance == 0) continue;
      has_variance = 0;
      for_block_rows(row, col, [](float* values, int n) { std::fill(values, values + n, 0.0F); });
    }
  }
}

// Adds the motion of each block and its neighbours to variance_. Returns whether there is any.
bool Background::spread_motion(double factor) {
  if (!knows_motion_) return false;
  // What moved has moved on since.
  const int reach = motion_is_of_now_ ? 1 : kPassedBlocks;
  bool any = false;
  for (int row = 0; row < block_rows_; ++row) {
    for (int col = 0; col < block_cols_; ++col) {
      const float most = most_motion_around(row, col, reach);
      if (most == 0.0F) continue;
      const float variance = static_cast<float>(factor) * most;
      for_block_rows(row, col, [&](float* values, int n) {
        for (int i = 0; i < n; ++i) values[i] += variance;
      });
      has_variance_[static_cast<std::size_t>(row * block_cols_ + col)] = 1;
      any = true;
    }
  }
  return any;
}

float Background::most_motion_around(int block_row, int block_col, int reach_cols) const {
  float most = 0.0F;
  const int first = std::max(0, block_col - reach_cols);
  const int last = std::min(block_cols_ - 1, block_col + reach_cols);
  for (int r = std::max(0, block_row - 1); r <= std::min(block_rows_ - 1, block_row + 1); ++r) {
    for (int c = first; c <= last; ++c) {
      most = std::max(most, motion_[static_cast<std::size_t>(r * block_cols_ + c)]);
    }
  }
  return most;
}

template <typename Action>
void Background::for_block_rows(int block_row, int block_col, const Action& action) {
  const int first_col = block_col * kBlockCols;
  const int last_row = std::min(variance_.rows, (block_row + 1) * kBlockRows);
  const int cols = std::min(kBlockCols, variance_.cols - first_col);
  for (int row = block_row * kBlockRows; row < last_row; ++row) {
    action(variance_.ptr<float>(row) + first_col, cols);
  }
}

// Marks what a dark exposure saturates, then what a lamp saturates in the lit one. Returns whether
// there is any.
template <typename Pixel>
bool Background::mark_blind(const DarkPair& pair, const LitFrame& frame) {
  const bool any_row = std::any_of(saturated_.begin(), saturated_.end(),
                                   [](std::uint8_t flags) { return flags != 0; });
  if (!any_row) return false;
  std::memset(marked_.data, 0, marked_.total());
  std::fill(lamps_.begin(), lamps_.end(), std::uint8_t{0});
  bool any = false;
  for (int row = 0; row < frame.lit.rows; ++row) {
    if ((saturated_[static_cast<std::size_t>(row)] & kDarkSaturated) == 0) continue;
    for (const cv::Mat* const image : {pair.before, pair.after}) {
      if (image == nullptr || row >= image->rows) continue;
      mark_dark_row(image->ptr<Pixel>(row), row, frame.full_scale_dn);
    }
    any = true;
  }
  if (mark_lit_rows<Pixel>(frame)) any = true;
  if (any) dilate_blind();
  return any;
}

template <typename Pixel>
void Background::mark_dark_row(const Pixel* pixels, int row, int full_scale_dn) {
  auto* const marks = marked_.ptr<std::uint8_t>(row);
  std::uint8_t* const lamps = lamps_.data() + (row / kBlockRows) * block_cols_;
  for (int col = 0; col < marked_.cols; ++col) {
    if (pixels[col] < full_scale_dn) continue;
    marks[col] = 1;
    lamps[col / kBlockCols] = 1;
  }
}

template <typename Pixel>
bool Background::mark_lit_rows(const LitFrame& frame) {
  std::fill(run_.begin(), run_.end(), 0);
  bool any = false;
  for (int row = 0; row < frame.lit.rows; ++row) {
    if ((saturated_[static_cast<std::size_t>(row)] & kLitSaturated) == 0) {
      std::fill(run_.begin(), run_.end(), 0);
      continue;
    }
    const auto* const pixels = frame.lit.ptr<Pixel>(row);
    for (int col = 0; col < frame.lit.cols; ++col) {
      int& run = run_[static_cast<std::size_t>(col)];
      run = pixels[col] >= frame.full_scale_dn ? run + 1 : 0;
      if (run == 0) continue;
      const bool is_long = run > kLongestStripeRun;
      if (!is_long && !is_near_lamp(row, col)) continue;
      const int first = run == kLongestStripeRun + 1 ? row - kLongestStripeRun : row;
      for (int r = first; r <= row; ++r) marked_.at<std::uint8_t>(r, col) = 1;
      any = true;
    }
  }
  return any;
}

bool Background::is_near_lamp(int row, int col) const {
  const int block_row = row / kBlockRows;
  const int block_col = col / kBlockCols;
  for (int r = std::max(0, block_row - 1); r <= std::min(block_rows_ - 1, block_row + 1); ++r) {
    const int last = std::min(block_cols_ - 1, block_col + kLampReachBlocks);
    for (int c = std::max(0, block_col - kLampReachBlocks); c <= last; ++c) {
      if (lamps_[static_cast<std::size_t>(r * block_cols_ + c)] != 0) return true;
    }
  }
  return false;
}

// A pixel is blind if a marked one is within kBlindRows and kBlindCols.
void Background::dilate_blind() {
  std::memset(blind_.data, 0, blind_.total());
  for (int row = 0; row < marked_.rows; ++row) {
    const auto* const marks = marked_.ptr<std::uint8_t>(row);
    if (row_maximum(marks, marked_.cols) == 0) continue;
    const int last_row = std::min(marked_.rows - 1, row + kBlindRows);
    for (int col = 0; col < marked_.cols; ++col) {
      if (marks[col] == 0) continue;
      const int first_col = std::max(0, col - kBlindCols);
      const int last_col = std::min(marked_.cols - 1, col + kBlindCols);
      for (int r = std::max(0, row - kBlindRows); r <= last_row; ++r) {
        auto* const blind = blind_.ptr<std::uint8_t>(r);
        std::fill(blind + first_col, blind + last_col + 1, std::uint8_t{1});
      }
    }
  }
}

}  // namespace striper::detail
