// SPDX-License-Identifier: Apache-2.0
#include "ambient/pixels/motion.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <type_traits>

#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

// A block moves if its mean square difference is this many times the noise's: six sigmas of a mean
// of 128 squares.
constexpr float kMotionRatio = 1.75F;
// Or if it and those beside it differ by so much more than noise: six sigmas of a mean of 1152.
constexpr float kLeastExcess = 0.25F;

// Of blocks that do not move the lowest twentieth, and by how much noise alone is below its mean
// there: 1 - 1.64 sqrt(2 / 128).
constexpr double kStillFraction = 0.05;
constexpr double kStillLevel = 0.79;
constexpr std::size_t kMostSampledBlocks = 4096;

// An edge between field rows leaves an error uniform in an interval: at its end three times the
// variance.
constexpr float kWorstOfEdge = 3.0F;

struct BlockSums {
  float squares = 0.0F;
  float brighter = 0.0F;
  float level = 0.0F;
};

// Of rows of so many pixels side by side, at most a block's: perhaps known when this is compiled.
// Each column is added up by itself, so that a vector can hold many.
template <typename Pixel, typename Count>
BlockSums sums_of(const cv::Mat& a, const cv::Mat& b, cv::Range rows, int col, Count any_count) {
  const int count = any_count;
  std::array<float, Motion::kCols> squares{};
  std::array<float, Motion::kCols> brighter{};
  std::array<float, Motion::kCols> level{};
  for (int row = rows.start; row < rows.end; ++row) {
    const auto* const p = a.ptr<Pixel>(row) + col;
    const auto* const q = b.ptr<Pixel>(row) + col;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const auto value = static_cast<float>(p[i]);
      const float d = value - static_cast<float>(q[i]);
      const float up = std::max(d, 0.0F);
      squares[i] += d * d;
      brighter[i] += up * up;
      level[i] += value;
    }
  }
  const auto sum = [](const auto& of) { return std::accumulate(of.begin(), of.end(), 0.0F); };
  return {sum(squares), sum(brighter), sum(level)};
}

}  // namespace

void Motion::prepare(cv::Size size) {
  if (size == size_) return;
  size_ = size;
  rows_ = (size.height + kRows - 1) / kRows;
  cols_ = (size.width + kCols - 1) / kCols;
  const auto blocks = static_cast<std::size_t>(rows_) * static_cast<std::size_t>(cols_);
  for (auto* values : {&squares_, &brighter_, &level_, &expected_, &excess_}) {
    values->assign(blocks, 0.0F);
  }
  has_.assign(blocks, 0);
  sorted_.reserve(2 * kMostSampledBlocks + 2);
}

void Motion::compare_strip(const cv::Mat& before, const cv::Mat& after, int strip) {
  if (before.depth() == CV_8U) {
    compare_pixels<std::uint8_t>(before, after, strip);
  } else {
    compare_pixels<std::uint16_t>(before, after, strip);
  }
}

template <typename Pixel>
void Motion::compare_pixels(const cv::Mat& a, const cv::Mat& b, int strip) {
  using WholeBlock = std::integral_constant<int, kCols>;
  const int first = strip * kRows;
  const cv::Range rows(first, std::min({first + kRows, a.rows, b.rows}));
  for (int col = 0; col < cols_; ++col) {
    const int at = col * kCols;
    const int count = std::min(kCols, a.cols - at);
    const BlockSums sums = count == kCols ? sums_of<Pixel>(a, b, rows, at, WholeBlock())
                                          : sums_of<Pixel>(a, b, rows, at, count);
    const float scale = 1.0F / static_cast<float>(std::max(1, rows.size() * count));
    const std::size_t i = index(strip, col);
    squares_[i] = scale * sums.squares;
    brighter_[i] = 2.0F * scale * sums.brighter;
    level_[i] = scale * sums.level;
  }
}

void Motion::compare_with_lit(const cv::Mat& lit, const cv::Mat& dark, const cv::Mat& known) {
  for (int strip = 0; strip < rows_; ++strip) compare_strip(lit, dark, strip);
  for (int row = 0; row < rows_; ++row) {
    for (int col = 0; col < cols_; ++col) {
      // The stripe is brighter in three blocks of a column at most, and those beside are not: what
      // stays is brighter over more rows.
      const auto least_about = [&](int middle) {
        float least = brighter_[index(middle, col)];
        for (int r = std::max(0, middle - 1); r <= std::min(rows_ - 1, middle + 1); ++r) {
          least = std::min(least, brighter_[index(r, col)]);
        }
        return least;
      };
      float plateau = 0.0F;
      for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r) {
        plateau = std::max(plateau, least_about(r));
      }
      float& squares = squares_[index(row, col)];
      const float darker = 2.0F * squares - brighter_[index(row, col)];
      squares = std::max(darker, plateau);
      if (!known.empty()) squares -= kWorstOfEdge * mean_of(known, row, col);
    }
  }
}

float Motion::mean_of(const cv::Mat& variance, int row, int col) const {
  float sum = 0.0F;
  int pixels = 0;
  for_rows_of(variance, row, col, [&](const float* values, int n) {
    for (int i = 0; i < n; ++i) sum += values[i];
    pixels += n;
  });
  return sum / static_cast<float>(std::max(1, pixels));
}

void Motion::leave_out(const cv::Mat& before, const cv::Mat& after, const cv::Mat& masked) {
  if (before.depth() == CV_8U) {
    compare_seen<std::uint8_t>(before, after, masked);
  } else {
    compare_seen<std::uint16_t>(before, after, masked);
  }
}

template <typename Pixel>
void Motion::compare_seen(const cv::Mat& a, const cv::Mat& b, const cv::Mat& masked) {
  for (int row = 0; row < rows_; ++row) {
    const int last = std::min({(row + 1) * kRows, a.rows, b.rows, masked.rows});
    for (int col = 0; col < cols_; ++col) {
      float squares = 0.0F;
      int seen = 0;
      int hidden = 0;
      for (int r = row * kRows; r < last; ++r) {
        const auto* const p = a.ptr<Pixel>(r);
        const auto* const q = b.ptr<Pixel>(r);
        const auto* const mask = masked.ptr<std::uint8_t>(r);
        for (int i = col * kCols; i < std::min(a.cols, (col + 1) * kCols); ++i) {
          const auto d = static_cast<float>(p[i]) - static_cast<float>(q[i]);
          squares += mask[i] == 0 ? d * d : 0.0F;
          ++(mask[i] == 0 ? seen : hidden);
        }
      }
      if (hidden == 0) continue;
      squares_[index(row, col)] = seen < hidden ? 0.0F : squares / static_cast<float>(seen);
    }
  }
}

double Motion::noise_of_quietest_blocks() {
  const std::size_t stride = std::max<std::size_t>(1, squares_.size() / kMostSampledBlocks);
  sorted_.clear();
  for (std::size_t i = 0; i < squares_.size(); i += stride) sorted_.push_back(squares_[i]);
  const auto still = static_cast<std::size_t>(kStillFraction * static_cast<double>(sorted_.size()));
  return 0.5 * static_cast<double>(nth_smallest(sorted_, still)) / kStillLevel;
}

void Motion::keep_beyond(const NoiseModel& noise, double dark_noise_gain) {
  for (std::size_t i = 0; i < squares_.size(); ++i) {
    const double variance = noise.variance_dn2(static_cast<double>(level_[i]));
    expected_[i] = static_cast<float>((1.0 + dark_noise_gain) * variance);
    excess_[i] = squares_[i] - expected_[i];
  }
  for (int row = 0; row < rows_; ++row) {
    for (int col = 0; col < cols_; ++col) {
      const std::size_t i = index(row, col);
      const bool moves = squares_[i] > kMotionRatio * expected_[i];
      squares_[i] = std::max(moves ? excess_[i] : 0.0F, excess_around(row, col));
    }
  }
}

// The mean excess of a block and those beside it, where it is more than noise makes. What is plain
// in one block counts there alone.
float Motion::excess_around(int row, int col) const {
  float excess = 0.0F;
  float expected = 0.0F;
  float blocks = 0.0F;
  for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r) {
    for (int c = std::max(0, col - 1); c <= std::min(cols_ - 1, col + 1); ++c) {
      const std::size_t i = index(r, c);
      excess += std::min(excess_[i], (kMotionRatio - 1.0F) * expected_[i]);
      expected += expected_[i];
      blocks += 1.0F;
    }
  }
  return excess > kLeastExcess * expected ? excess / blocks : 0.0F;
}

bool Motion::add_to(cv::Mat& variance, double factor) {
  bool any = false;
  for (int row = 0; row < rows_; ++row) {
    for (int col = 0; col < cols_; ++col) {
      const float most = most_around(row, col);
      if (most == 0.0F) continue;
      const float added = static_cast<float>(factor) * most;
      for_rows_of(variance, row, col, [&](float* values, int n) {
        for (int i = 0; i < n; ++i) values[i] += added;
      });
      has_[index(row, col)] = 1;
      any = true;
    }
  }
  return any;
}

void Motion::clear(cv::Mat& variance) {
  for (int row = 0; row < rows_; ++row) {
    for (int col = 0; col < cols_; ++col) {
      if (has_[index(row, col)] == 0) continue;
      has_[index(row, col)] = 0;
      for_rows_of(variance, row, col,
                  [](float* values, int n) { std::fill(values, values + n, 0.0F); });
    }
  }
}

float Motion::most_around(int row, int col) const {
  float most = 0.0F;
  for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r) {
    for (int c = std::max(0, col - 1); c <= std::min(cols_ - 1, col + 1); ++c) {
      most = std::max(most, squares_[index(r, c)]);
    }
  }
  return most;
}

template <typename Matrix, typename Action>
void Motion::for_rows_of(Matrix& variance, int row, int col, const Action& action) const {
  const int first_col = col * kCols;
  const int last_row = std::min(variance.rows, (row + 1) * kRows);
  const int count = std::min(kCols, variance.cols - first_col);
  for (int r = row * kRows; r < last_row; ++r) {
    action(variance.template ptr<float>(r) + first_col, count);
  }
}

}  // namespace striper::detail
