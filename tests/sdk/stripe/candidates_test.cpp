// SPDX-License-Identifier: Apache-2.0
// Proves that the one-pass search gives, on every instruction set of this machine, exactly what a
// plain loop gives: every width from 1 to 200 at odd strides, rows of up to 8197 pixels, scan lines
// of more than 256 blocks, 8 and 16 bit, both axes, with and without a dark image and a mask; and
// that ranking a few blocks finds the rivals that ranking all of them does. Does not prove that it
// is fast (tests/bench does).
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "stripe/candidates/block_maxima.hpp"
#include "support/instruction_sets.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using detail::BlockMaxima;

using Peak = BlockMaxima::Peak;

// Pixels inside a larger buffer, so that rows do not follow one another and reading outside shows.
cv::Mat random_image(int rows, int cols, int type, int stride, int levels) {
  cv::Mat buffer(rows, stride, type);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < stride; ++c) {
      const auto value = static_cast<int>(testing::random_generator()() % levels);
      if (type == CV_8UC1) {
        buffer.at<std::uint8_t>(r, c) = static_cast<std::uint8_t>(value);
      } else {
        buffer.at<std::uint16_t>(r, c) = static_cast<std::uint16_t>(value * 257);
      }
    }
  }
  return buffer.colRange(stride - cols, stride);
}

int pixel(const cv::Mat& image, StripeAxis axis, int line, int across) {
  const int r = axis == StripeAxis::kColumns ? across : line;
  const int c = axis == StripeAxis::kColumns ? line : across;
  return image.depth() == CV_8U ? image.at<std::uint8_t>(r, c) : image.at<std::uint16_t>(r, c);
}

// The oracle: what the header says, written plainly.
Peak block_peak(const LitFrame& frame, StripeAxis axis, int block, int line) {
  const int length = axis == StripeAxis::kColumns ? frame.lit.rows : frame.lit.cols;
  Peak best{block * BlockMaxima::kBlock, 0, 0};
  for (int k = best.across; k < std::min(length, (block + 1) * BlockMaxima::kBlock); ++k) {
    int value = pixel(frame.lit, axis, line, k);
    if (!frame.dark.empty()) value = std::max(0, value - pixel(frame.dark, axis, line, k));
    if (!frame.masked.empty() && pixel(frame.masked, axis, line, k) != 0) value = 0;
    if (value > best.value_dn) best = {k, value, 0};
  }
  return best;
}

void expect_equal_to_oracle(const LitFrame& frame, StripeAxis axis) {
  BlockMaxima maxima;
  maxima.find(frame, axis);
  maxima.rank();
  const int lines = axis == StripeAxis::kColumns ? frame.lit.cols : frame.lit.rows;
  ASSERT_EQ(maxima.lines(), lines);
  for (int line = 0; line < lines; ++line) {
    std::vector<Peak> peaks;
    for (int block = 0; block < maxima.blocks(); ++block) {
      peaks.push_back(block_peak(frame, axis, block, line));
      ASSERT_EQ(maxima.at(block, line).value_dn, peaks.back().value_dn) << block << ' ' << line;
      ASSERT_EQ(maxima.at(block, line).across, peaks.back().across) << block << ' ' << line;
    }
    std::vector<Peak> ranked = peaks;
    for (std::size_t i = 0; i < peaks.size(); ++i) {
      const bool alone = peaks.size() == 1;
      const int before = alone ? 0 : peaks[i > 0 ? i - 1 : 1].value_dn;
      const int after = alone ? 0 : peaks[i + 1 < peaks.size() ? i + 1 : i - 1].value_dn;
      ranked[i].prominence_dn = std::max(0, peaks[i].value_dn - std::min(before, after));
    }
    std::stable_sort(ranked.begin(), ranked.end(), [](const Peak& a, const Peak& b) {
      return a.prominence_dn > b.prominence_dn;
    });
    ASSERT_EQ(maxima.best_across()[static_cast<std::size_t>(line)], ranked[0].across) << line;
    ranked.resize(BlockMaxima::kBest);
    for (int n = 0; n < BlockMaxima::kBest; ++n) {
      Peak expected = ranked[static_cast<std::size_t>(n)];
      if (expected.prominence_dn == 0) expected = {};
      ASSERT_EQ(maxima.prominence_dn(n, line), expected.prominence_dn) << n << ' ' << line;
      ASSERT_EQ(maxima.best(n, line).prominence_dn, expected.prominence_dn) << n << ' ' << line;
      ASSERT_EQ(maxima.best(n, line).value_dn, expected.value_dn) << n << ' ' << line;
      ASSERT_EQ(maxima.best(n, line).across, expected.across) << n << ' ' << line;
    }
  }
}

struct Case {
  int type;
  StripeAxis axis;
  bool has_dark;
  bool has_masked;

  std::string name() const {
    return std::string(type == CV_8UC1 ? "Bits8" : "Bits16") +
           (axis == StripeAxis::kColumns ? "Columns" : "Rows") + (has_dark ? "Dark" : "") +
           (has_masked ? "Masked" : "");
  }
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name(); }

class EveryInstructionSet : public ::testing::TestWithParam<Case> {};

TEST_P(EveryInstructionSet, EqualsTheScalarOracleOnAllWidthsAndOddStrides) {
  const Case& c = GetParam();
  for (int width = 1; width <= 200; ++width) {
    const int height = 1 + static_cast<int>(testing::random_generator()() % 75);
    const int stride = ((width + 1) | 1) + 2 * static_cast<int>(testing::random_generator()() % 9);
    ASSERT_EQ(stride % 2, 1);
    // Few levels make ties, in which the first must win; many exercise the unsigned comparison.
    const int levels = width % 3 == 0 ? 4 : 256;
    LitFrame frame;
    frame.lit = random_image(height, width, c.type, stride, levels);
    if (c.has_dark) frame.dark = random_image(height, width, c.type, stride + 2, levels);
    if (c.has_masked) frame.masked = random_image(height, width, CV_8UC1, stride + 4, 2);
    testing::for_each_instruction_set([&] { expect_equal_to_oracle(frame, c.axis); });
    if (HasFatalFailure()) FAIL() << width << "x" << height << " stride " << stride;
  }
}

// Rows that the search cuts into pieces, and more blocks than 8 bits number.
TEST_P(EveryInstructionSet, EqualsTheScalarOracleOnLongRowsAndLines) {
  const Case& c = GetParam();
  for (const cv::Size size : {cv::Size(767, 40), cv::Size(1537, 33), cv::Size(3073, 65),
                              cv::Size(37, 8197), cv::Size(8197, 37)}) {
    LitFrame frame;
    frame.lit = random_image(size.height, size.width, c.type, size.width + 3, 256);
    if (c.has_dark) frame.dark = random_image(size.height, size.width, c.type, size.width, 256);
    if (c.has_masked) frame.masked = random_image(size.height, size.width, CV_8UC1, size.width, 2);
    testing::for_each_instruction_set([&] { expect_equal_to_oracle(frame, c.axis); });
    if (HasFatalFailure()) FAIL() << size.width << "x" << size.height;
  }
}

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const int type : {CV_8UC1, CV_16UC1}) {
    for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
      for (const bool dark : {false, true}) {
        for (const bool masked : {false, true}) cases.push_back({type, axis, dark, masked});
      }
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(BlockMaxima, EveryInstructionSet, ::testing::ValuesIn(all_cases()),
                         [](const auto& instance) { return instance.param.name(); });

TEST(BlockMaxima, OfEquallyProminentBlocksTheFirstComeFirst) {
  constexpr int kLength = 40 * BlockMaxima::kBlock;
  for (const int type : {CV_8UC1, CV_16UC1}) {
    LitFrame frame;
    frame.lit = cv::Mat::zeros(kLength, 70, type);
    for (int peak = 0; peak < 70 * 12; ++peak) {
      const int across = static_cast<int>(testing::random_generator()() % kLength);
      const int value = 1 + static_cast<int>(testing::random_generator()() % 3);
      frame.lit.row(across).col(peak % 70) = cv::Scalar(value);
    }
    const cv::Mat turned = frame.lit.t();
    testing::for_each_instruction_set([&] { expect_equal_to_oracle(frame, StripeAxis::kColumns); });
    frame.lit = turned;
    testing::for_each_instruction_set([&] { expect_equal_to_oracle(frame, StripeAxis::kRows); });
  }
}

void expect_same_places(const BlockMaxima::Rivals& a, const BlockMaxima::Rivals& b) {
  EXPECT_EQ(a.weak_lines, b.weak_lines);
  EXPECT_EQ(a.flat_lines, b.flat_lines);
  ASSERT_EQ(a.places.size(), b.places.size());
  for (std::size_t i = 0; i < a.places.size(); ++i) {
    EXPECT_EQ(a.places[i].line, b.places[i].line);
    EXPECT_EQ(a.places[i].across, b.places[i].across);
  }
}

TEST(BlockMaxima, RanksFurtherOnlyWhereALineHasAThird) {
  LitFrame frame;
  frame.lit = cv::Mat::zeros(10 * BlockMaxima::kBlock, 90, CV_8UC1);
  const std::array<int, 4> values{200, 100, 60, 30};
  for (int line = 1; line < 90; ++line) {
    for (int n = 0; n < line % 5; ++n) {
      frame.lit.at<std::uint8_t>((7 - 2 * n) * BlockMaxima::kBlock + 5, line) =
          static_cast<std::uint8_t>(values[static_cast<std::size_t>(n)]);
    }
  }
  for (const int second_dn : {20, 50, 90, 150}) {
    testing::for_each_instruction_set([&] {
      BlockMaxima whole;
      BlockMaxima first;
      whole.find(frame, StripeAxis::kColumns);
      first.find(frame, StripeAxis::kColumns);
      whole.rank();
      first.rank(BlockMaxima::kFirst);
      for (int line = 0; line < 90; ++line) {
        for (int n = 0; n < BlockMaxima::kFirst; ++n) {
          EXPECT_EQ(first.best(n, line).across, whole.best(n, line).across);
        }
        for (int n = 0; n <= BlockMaxima::kFirst; ++n) {
          EXPECT_EQ(first.prominence_dn(n, line), whole.prominence_dn(n, line));
        }
      }
      EXPECT_EQ(first.best_across(), whole.best_across());
      BlockMaxima::Rivals of_whole;
      BlockMaxima::Rivals of_first;
      whole.find_rivals({second_dn, 0, 50}, of_whole);
      first.find_rivals({second_dn, 0, 50}, of_first);
      EXPECT_EQ(of_whole.flat_lines.size(), 18);
      EXPECT_EQ(of_whole.places.size(), 18 * (second_dn > 100  ? 0
                                              : second_dn > 60 ? 3
                                              : second_dn > 30 ? 5
                                                               : 6));
      expect_same_places(of_first, of_whole);
    });
  }
}

// Whoever reuses pixels that nobody else holds would else take other ones for every frame.
TEST(BlockMaxima, HoldsOnToNoPixels) {
  LitFrame frame;
  frame.lit = random_image(40, 70, CV_8UC1, 70, 256).clone();
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    BlockMaxima maxima;
    maxima.find(frame, axis);
    maxima.rank();
    EXPECT_EQ(frame.lit.u->refcount, 1);
  }
}

TEST(BlockMaxima, KnowsTheLinesWithMaskedPixels) {
  LitFrame frame;
  frame.lit = cv::Mat::zeros(50, 9, CV_8UC1);
  frame.masked = cv::Mat::zeros(50, 9, CV_8UC1);
  frame.masked.at<std::uint8_t>(40, 3) = 255;
  BlockMaxima maxima;
  maxima.find(frame, StripeAxis::kColumns);
  for (int line = 0; line < 9; ++line) EXPECT_EQ(maxima.is_partly_masked(line), line == 3);
  maxima.find(frame, StripeAxis::kRows);
  for (int line = 0; line < 50; ++line) EXPECT_EQ(maxima.is_partly_masked(line), line == 40);
}

TEST(BlockMaxima, AStripeOnADimFloorOutranksABrightSky) {
  LitFrame frame;
  frame.lit = cv::Mat(480, 100, CV_8UC1, cv::Scalar(20));
  frame.lit.rowRange(0, 200) = cv::Scalar(200);
  frame.lit.row(333) = cv::Scalar(60);
  BlockMaxima maxima;
  maxima.find(frame, StripeAxis::kColumns);
  maxima.rank();
  // The sky's border is more prominent still; the filter tells an edge from a stripe.
  EXPECT_EQ(maxima.best(1, 50).across, 333);
  EXPECT_EQ(maxima.best(1, 50).prominence_dn, 40);
}

}  // namespace
}  // namespace striper
