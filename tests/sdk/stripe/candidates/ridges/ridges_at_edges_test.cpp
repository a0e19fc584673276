// SPDX-License-Identifier: Apache-2.0
// Proves that a ridge is measured on the surface that it stands on where a brighter one begins
// beside it: position and amplitude, on either side, along both axes, in 8 and 16 bits, with the
// dark channel of a colour difference; and that what no edge is close to stays as it is. Does not
// prove what is a ridge.
#include "stripe/candidates/ridges/ridges_at_edges.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "core/pixel_box.hpp"
#include "stripe/profile/profile_plan.hpp"
#include "support/allocation_counter.hpp"

namespace striper::detail {
namespace {

constexpr int kLines = 100;
constexpr int kLength = 80;
constexpr double kBlur = 0.5;
constexpr double kDark_dn = 13.0;
constexpr double kBright_dn = 86.0;
constexpr double kAmplitude_dn = 22.0;

struct Case {
  std::string name;
  double width = 0.8;
  double edge = 4.5;  // From the stripe's middle, pixels across; the surface beyond is bright.
  StripeAxis axis = StripeAxis::kColumns;
  double scale = 1.0;  // DN; 16: 16 bits.
  bool has_dark = false;
  bool has_masked = false;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Board {
 public:
  explicit Board(const Case& c) : case_(c) {
    frame_.full_scale_dn = c.scale > 1.0 ? 4095 : 255;
    frame_.lit = image([&](int line, int k) { return lit_dn(line, k); });
    if (c.has_dark) frame_.dark = image([&](int line, int k) { return dark_dn(line, k); });
    if (c.has_masked) {
      frame_.masked = cv::Mat::zeros(frame_.lit.size(), CV_8U);
      frame_.masked.at<std::uint8_t>(0, 0) = 255;
    }
    noise_.model.read_noise_dn = 1.0;
    noise_.model.dn_per_electron = 0.02 * c.scale;
    noise_.model.black_level_dn = 0.0;
    for (int line = 0; line < kLines; ++line) {
      peaks_.seeds.push_back({line, static_cast<std::int32_t>(std::lround(position(line)))});
      rises_.push_back(rise(line));
    }
    peaks_.make_room(kLines);
    measure_profiles(at_hand().images, plan(), peaks_.seeds.data(), kLines, peaks_.measurements());
  }

  static double position(int line) { return 40.0 + 0.037 * line; }
  const PeakList& peaks() const { return peaks_; }

  void measure(RidgesAtEdges& ridges) {
    const FrameAtHand frame = at_hand();
    const ProfilePlan p = plan();
    ridges.measure({frame, p, distance()}, rises_, peaks_);
  }

 private:
  // Of the bright surface in a pixel.
  double bright_part(int line, int k) const {
    const double from = k - position(line);
    const double step = (case_.edge > 0.0 ? 1.0 : -1.0) * (from - case_.edge);
    return 0.5 * std::erfc(-step / (kBlur * std::numbers::sqrt2));
  }
  // The other channel, in which the bright surface is nearly as bright as can be.
  double dark_dn(int line, int k) const {
    return case_.has_dark ? 7.0 + 160.0 * bright_part(line, k) : 0.0;
  }
  double lit_dn(int line, int k) const {
    const double from = k - position(line);
    const double stripe =
        kAmplitude_dn * std::exp(-0.5 * from * from / (case_.width * case_.width));
    const double surface = kDark_dn + (kBright_dn - kDark_dn) * bright_part(line, k);
    return dark_dn(line, k) + surface + stripe;
  }
  double value_dn(int line, int k) const { return lit_dn(line, k) - dark_dn(line, k); }

  template <typename Value>
  cv::Mat image(const Value& value) const {
    const bool is_columns = case_.axis == StripeAxis::kColumns;
    cv::Mat dn(is_columns ? kLength : kLines, is_columns ? kLines : kLength, CV_64F);
    for (int line = 0; line < kLines; ++line) {
      for (int k = 0; k < kLength; ++k) {
        dn.at<double>(is_columns ? k : line, is_columns ? line : k) = case_.scale * value(line, k);
      }
    }
    cv::Mat whole;
    dn.convertTo(whole, case_.scale > 1.0 ? CV_16U : CV_8U);
    return whole;
  }

  FrameAtHand at_hand() const {
    return {frame_, case_.axis, images_of(frame_, case_.axis), noise_, 1.0, 1.0};
  }
  ProfilePlan plan() const {
    return plan_profile(WidthModel{.at_pivot = effective_width()}, noise_, true,
                        BackgroundReach::kNarrow);
  }
  double effective_width() const { return std::sqrt(case_.width * case_.width + kPixelBox2); }
  int distance() const { return static_cast<int>(std::ceil(2.4 * effective_width())); }
  std::int32_t rise(int line) const {
    const int at = static_cast<int>(std::lround(position(line)));
    const double side = std::max(value_dn(line, at - distance()), value_dn(line, at + distance()));
    return static_cast<std::int32_t>(case_.scale * (value_dn(line, at) - side));
  }

  Case case_;
  LitFrame frame_;
  PlanNoise noise_;
  PeakList peaks_;
  std::vector<std::int32_t> rises_;
};

class ARidgeAtAnEdge : public ::testing::TestWithParam<Case> {
 protected:
  static double off_px(const Board& board, int line) {
    return board.peaks().position(static_cast<std::size_t>(line)) - Board::position(line);
  }
  static double height(const Board& board, int line) {
    const auto i = static_cast<std::size_t>(line);
    return board.peaks().amplitude[i] / (GetParam().scale * kAmplitude_dn);
  }
  static bool is_right(const Board& board, int line) {
    return std::abs(off_px(board, line)) < 0.2 * GetParam().width &&
           std::abs(height(board, line) - 1.0) < 0.3;
  }
};

TEST_P(ARidgeAtAnEdge, IsMeasuredOnItsOwnSurface) {
  Board board(GetParam());
  int wrong = 0;
  for (int line = 0; line < kLines; ++line) wrong += is_right(board, line) ? 0 : 1;
  ASSERT_GT(wrong, kLines / 3) << "a straight background has the ridges as well";
  RidgesAtEdges ridges;
  board.measure(ridges);
  EXPECT_GE(ridges.again(), static_cast<std::size_t>(wrong));
  for (int line = 0; line < kLines; ++line) {
    EXPECT_TRUE(is_right(board, line))
        << line << ": " << off_px(board, line) << " px, " << height(board, line);
  }
}

INSTANTIATE_TEST_SUITE_P(
    RidgesAtEdges, ARidgeAtAnEdge,
    ::testing::Values(Case{"After"}, Case{"Before", 0.8, -4.5}, Case{"Nearer", 0.8, 4.0},
                      Case{"Wide", 2.0, 8.0}, Case{"WideBefore", 2.0, -7.0},
                      Case{"Rows", 0.8, 4.5, StripeAxis::kRows},
                      Case{"Bits16", 0.8, 4.5, StripeAxis::kColumns, 16.0},
                      Case{"Difference", 0.8, 4.5, StripeAxis::kColumns, 1.0, true},
                      Case{"Masked", 0.8, 4.5, StripeAxis::kColumns, 1.0, false, true}),
    [](const auto& tested) { return tested.param.name; });

TEST(RidgesAtEdges, LeaveWhatNoEdgeIsCloseTo) {
  Board board({"Far", 0.8, 25.0});
  const std::vector<float> before(board.peaks().amplitude.begin(),
                                  board.peaks().amplitude.begin() + kLines);
  RidgesAtEdges ridges;
  board.measure(ridges);
  EXPECT_EQ(ridges.again(), 0U);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(board.peaks().amplitude[i], before[i]);
}

TEST(RidgesAtEdges, AllocateNothingOnceAFrameWasAsLarge) {
  Board board({"After"});
  Board next({"After"});
  RidgesAtEdges ridges;
  board.measure(ridges);
  const testing::AllocationCounter counter;
  next.measure(ridges);
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper::detail
