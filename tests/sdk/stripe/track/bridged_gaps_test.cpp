// SPDX-License-Identifier: Apache-2.0
// Proves that scan lines in whose midst a brighter surface hides the stripe's peak get it from the
// line of the sure returns on both sides, where it is and as well as they say, along both axes,
// beside faint edges and bends too, and from the returns on one side alone; and none where no light
// is there, however soft the edge is, where the returns about them are on no line, where texture is
// beside, where the frame shows no stripe, or where no return may be. Does not prove what later
// passes add, which frames need that, nor that what is said is a probability.
#include "stripe/track/bridged_gaps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/robust.hpp>

#include "core/pixel_box.hpp"
#include "stripe/select/forests/choice_trees.hpp"
#include "support/allocation_counter.hpp"
#include "support/edge_light.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

constexpr int kLines = 200;
constexpr int kLength = 90;
constexpr int kGapBegin = 80;
constexpr int kGapEnd = 120;
constexpr double kWidth_px = 0.8;
constexpr double kBlur_px = 0.45;
constexpr double kDark_dn = 13.0;
constexpr double kBright_dn = 86.0;
constexpr double kBlack_dn = 5.0;
constexpr double kAmplitude_dn = 12.0;  // On the dark surface.
constexpr double kSigma_px = 0.05;      // Of the sure returns.
constexpr double kExcess_px = 0.02;

struct Case {
  std::string name;
  StripeAxis axis = StripeAxis::kColumns;
  double bend_px = 0.0;           // The stripe is so far off
  int bend_at = kLines / 2;       // from this scan line.
  bool has_light = true;          // In the gap.
  int light_end = kGapEnd;        // Where that ends, in the gap.
  bool has_after = true;          // Sure returns behind it.
  int outpost = 0;                // But for one at this scan line,
  double outpost_off_px = 0.0;    // so far off the stripe.
  bool is_seen = true;            // The frame shows a stripe.
  double gap_off_px = 0.0;        // The stripe in the gap, from the line of the rest.
  double texture_dn = 0.0;        // Of what is beside, from pixel to pixel.
  double edge_px = 2.6;           // From the stripe's middle to where the bright surface begins,
  double edge_sigma_px = 0.0;     // how soft that is,
  double bright_dn = kBright_dn;  // and how bright it is.
  double scatter_px = kSigma_px;  // Of the sure returns, whatever they say.
  bool is_masked = false;         // Two pixels on either side of the middle.
  bool is_ignored = false;        // The whole gap.
  double least_dn = 0.0;
  double least_snr = 0.0;
  double least_probability = kSure;
  int least_bridged = 5;        // Of a hard case.
  int most_bridged = 0;         // Of a case that is not to be bridged; noise may decide of one.
  float own_confidence = 0.0F;  // Of a return half a pixel off; 0: there is none.
  ReturnStatus status = ReturnStatus::kOutlier;  // Of the gap's scan lines.
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

bool is_in_gap(int line) { return line >= kGapBegin && line < kGapEnd; }

class Gap {
 public:
  explicit Gap(const Case& c) : case_(c) {
    noise_.model.read_noise_dn = 0.7;
    noise_.model.dn_per_electron = 0.02;
    noise_.model.black_level_dn = kBlack_dn;
    frame_.full_scale_dn = 255;
    draw();
    report();
  }

  double position(int line) const {
    return 45.0 + 0.02 * line + (line >= case_.bend_at ? case_.bend_px : 0.0) +
           (is_in_gap(line) ? case_.gap_off_px : 0.0);
  }

  void measure(BridgedGaps& gaps) {
    ExpectedStripe expected;
    if (case_.is_ignored) {
      expected.ignored = cv::Mat::zeros(frame_.lit.size(), CV_8U);
      const cv::Rect gap(kGapBegin, 0, kGapEnd - kGapBegin, kLength);
      expected.ignored(gap) = 255;
    }
    const FrameAtHand at_hand{frame_, case_.axis, images_of(frame_, case_.axis),        noise_,
                              1.0,    1.0,        IgnoredPixels(&expected, frame_.grid)};
    const double effective = std::sqrt(kWidth_px * kWidth_px + kPixelBox2);
    const WidthModel width{.at_pivot = effective};
    const SearchedPart part;
    gaps.begin(kLines);
    gaps.measure({at_hand, part, width, kExcess_px, case_.least_dn, case_.least_snr,
                  case_.least_probability, 0.8F, 0.1F},
                 stripe_);
  }

  const Stripe& stripe() const { return stripe_; }

 private:
  // Of the bright surface, so far beyond its edge.
  double part_beyond(double off) const {
    if (case_.edge_sigma_px == 0.0) return off > 0.0 ? 1.0 : 0.0;
    return 0.5 * std::erfc(-off / (case_.edge_sigma_px * std::numbers::sqrt2));
  }

  void draw() {
    cv::Mat image(kLength, kLines, CV_8U);
    for (int line = 0; line < kLines; ++line) {
      const double edge = is_in_gap(line) ? position(line) + case_.edge_px : 1e3;
      const double laser_sigma = std::sqrt(kWidth_px * kWidth_px - kBlur_px * kBlur_px);
      const bool is_lit = !is_in_gap(line) || (case_.has_light && line < case_.light_end);
      const double height = is_lit ? kAmplitude_dn * kWidth_px / laser_sigma : 0.0;
      // The laser lights a surface in proportion to what the daylight does.
      const auto light = [&](double x) {
        const double z = (x - position(line)) / laser_sigma;
        const double surface =
            kDark_dn - kBlack_dn + (case_.bright_dn - kDark_dn) * part_beyond(x - edge);
        const double laser = height / (kDark_dn - kBlack_dn) * std::exp(-0.5 * z * z);
        return surface * (1.0 + laser);
      };
      for (int k = 0; k < kLength; ++k) {
        const double near_edge = std::abs(edge - k) < 20.0 ? edge : k;
        const double mean = kBlack_dn + testing::seen_of_edge(light, near_edge, k, kBlur_px);
        const double texture = std::abs(k - position(line)) > 1.0 ? case_.texture_dn : 0.0;
        const double sigma = std::hypot(std::sqrt(noise_.model.variance_dn2(mean)), texture);
        image.at<std::uint8_t>(k, line) =
            cv::saturate_cast<std::uint8_t>(testing::normal(mean, sigma));
      }
    }
    cv::Mat masked = cv::Mat::zeros(image.size(), CV_8U);
    for (int line = kGapBegin; line < kGapEnd && case_.is_masked; ++line) {
      const auto middle = static_cast<int>(std::lround(position(line)));
      masked.col(line).rowRange(middle - 2, middle + 3) = 255;
    }
    if (case_.is_masked) frame_.masked = masked;
    frame_.lit = case_.axis == StripeAxis::kColumns ? image : image.t();
  }

  void report() {
    stripe_.axis = case_.axis;
    stripe_.reset(kLines);
    stripe_.is_seen = case_.is_seen;
    for (int line = 0; line < kLines; ++line) {
      const auto i = static_cast<std::size_t>(line);
      if (is_in_gap(line)) stripe_.status[i] = case_.status;
      if (is_in_gap(line) && case_.own_confidence > 0.0F) {
        stripe_.across_px[i] = position(line) + 0.5;
        stripe_.sigma_px[i] = 0.3F;
        stripe_.confidence[i] = case_.own_confidence;
      }
      const bool is_outpost = case_.outpost > 0 && line == case_.outpost;
      if (is_in_gap(line) || (line >= kGapEnd && !case_.has_after && !is_outpost)) continue;
      const double off_px = is_outpost ? case_.outpost_off_px : 0.0;
      stripe_.across_px[i] = testing::normal(position(line) + off_px, case_.scatter_px);
      stripe_.sigma_px[i] = static_cast<float>(kSigma_px);
      stripe_.amplitude_dn[i] = static_cast<float>(kAmplitude_dn);
      stripe_.width_px[i] = static_cast<float>(kWidth_px);
      stripe_.confidence[i] = 0.999F;
      stripe_.status[i] = case_.is_seen ? ReturnStatus::kOk : ReturnStatus::kOutlier;
    }
  }

  Case case_;
  LitFrame frame_;
  PlanNoise noise_;
  Stripe stripe_;
};

class AGap : public ::testing::TestWithParam<StripeAxis> {};

TEST_P(AGap, IsBridgedBesideABrighterSurface) {
  Gap gap({"Bridged", GetParam()});
  BridgedGaps gaps;
  gap.measure(gaps);
  std::vector<double> pulls;
  double amplitude_dn = 0.0;
  for (int line = kGapBegin; line < kGapEnd; ++line) {
    if (!gaps.has(line)) continue;
    const auto i = static_cast<std::size_t>(line);
    EXPECT_EQ(gap.stripe().status[i], ReturnStatus::kOk);
    EXPECT_GE(gap.stripe().confidence[i], kSure);
    amplitude_dn += gap.stripe().amplitude_dn[i];
    const double off_px = gap.stripe().across_px[i] - gap.position(line);
    EXPECT_LT(std::abs(off_px), 0.6) << line;
    pulls.push_back(std::abs(off_px / gap.stripe().sigma_px[i]));
  }
  ASSERT_GT(pulls.size(), static_cast<std::size_t>(3 * (kGapEnd - kGapBegin) / 4));
  EXPECT_NEAR(robust_sigma(pulls), 1.0, 0.4);
  amplitude_dn /= static_cast<double>(pulls.size());
  EXPECT_NEAR(amplitude_dn, kAmplitude_dn, 0.15 * kAmplitude_dn);
  for (int line = 0; line < kGapBegin; ++line) EXPECT_FALSE(gaps.has(line));
}

INSTANTIATE_TEST_SUITE_P(BridgedGaps, AGap,
                         ::testing::Values(StripeAxis::kColumns, StripeAxis::kRows),
                         [](const auto& tested) {
                           return tested.param == StripeAxis::kColumns ? "Columns" : "Rows";
                         });

// A surface that lies a little before the rest, in the gap alone: what is held to the line says by
// how much the light draws it off, if not by enough.
class AGapOffTheLine : public ::testing::TestWithParam<double> {};

TEST_P(AGapOffTheLine, SaysSo) {
  Gap gap({.name = "OffTheLine", .gap_off_px = GetParam()});
  BridgedGaps gaps;
  gap.measure(gaps);
  std::vector<double> pulls;
  for (const BridgedGaps::Bridge& bridge : gaps.bridges()) {
    pulls.push_back(std::abs(bridge.across_px - gap.position(bridge.line)) / bridge.sigma_px);
  }
  ASSERT_GT(pulls.size(), 20U);
  EXPECT_LT(robust_sigma(pulls), 3.5);
}

INSTANTIATE_TEST_SUITE_P(BridgedGaps, AGapOffTheLine, ::testing::Values(-0.4, -0.2, 0.2, 0.4));

class NoGap : public ::testing::TestWithParam<Case> {};

TEST_P(NoGap, IsBridged) {
  Gap gap(GetParam());
  BridgedGaps gaps;
  gap.measure(gaps);
  int bridged = 0;
  for (int line = 0; line < kLines; ++line) bridged += gaps.has(line) ? 1 : 0;
  EXPECT_LE(bridged, GetParam().most_bridged);
}

INSTANTIATE_TEST_SUITE_P(
    BridgedGaps, NoGap,
    ::testing::Values(
        Case{.name = "WithoutLight", .has_light = false},
        Case{.name = "OfOneSideWithoutLight", .has_light = false, .has_after = false},
        Case{.name = "OfAFrameWithoutStripe", .is_seen = false},
        Case{.name = "OfTexture", .has_light = false, .texture_dn = 12.0, .most_bridged = 1},
        Case{.name = "OfASoftEdge", .has_light = false, .edge_px = 0.4, .edge_sigma_px = 1.2},
        Case{.name = "OfASofterEdge", .has_light = false, .edge_px = 0.0, .edge_sigma_px = 1.6},
        Case{.name = "OfReturnsOnNoLine", .scatter_px = 0.6},
        Case{.name = "OfMaskedPixels", .is_masked = true},
        Case{.name = "OfIgnoredPixels", .is_ignored = true},
        Case{.name = "OfBlindLines", .status = ReturnStatus::kBlind},
        Case{.name = "OfSureWeakLines", .own_confidence = 0.995F, .status = ReturnStatus::kWeak},
        Case{.name = "BelowALimit", .least_dn = 40.0},
        Case{.name = "InTooMuchNoise", .least_snr = 40.0},
        Case{.name = "OfReturnsThatAreSurer",
             .own_confidence = 0.99995F,
             .status = ReturnStatus::kNarrow}),
    [](const auto& tested) { return tested.param.name; });

// A soft edge shows a little light now and then, where none beside it does: of 480 scan lines three
// were taken, nine where such were not refused.
TEST(BridgedGaps, TakeHardlyAnythingOfSoftEdgesWithoutLight) {
  int bridged = 0;
  for (int time = 0; time < 12; ++time) {
    Gap gap({.name = "SoftEdge", .has_light = false, .edge_px = 0.4, .edge_sigma_px = 1.2});
    BridgedGaps gaps;
    gap.measure(gaps);
    for (int line = 0; line < kLines; ++line) bridged += gaps.has(line) ? 1 : 0;
  }
  EXPECT_LE(bridged, 5);
}

// How many were taken, each where the stripe is and as sure as it was rated.
int taken_at_the_stripe(const BridgedGaps& gaps, const Gap& gap) {
  int taken = 0;
  for (const BridgedGaps::Bridge& bridge : gaps.bridges()) {
    if (!bridge.is_taken) continue;
    ++taken;
    EXPECT_NEAR(bridge.across_px, gap.position(bridge.line), std::max(0.5, 3.0 * bridge.sigma_px));
    EXPECT_FLOAT_EQ(gap.stripe().confidence[static_cast<std::size_t>(bridge.line)],
                    bridge.probability);
  }
  return taken;
}

// From one side alone no farther than so, however many passes there are.
constexpr int kReachAlone = 8;

class AGapOfOneSide : public ::testing::TestWithParam<Case> {};

TEST_P(AGapOfOneSide, IsBridgedWithinReachWhereTheStripeIs) {
  Gap gap(GetParam());
  BridgedGaps gaps;
  gap.measure(gaps);
  EXPECT_GE(taken_at_the_stripe(gaps, gap), 1);
  const int end = std::min(GetParam().light_end, kGapBegin + kReachAlone);
  for (int line = end; line < kLines; ++line) EXPECT_FALSE(gaps.has(line)) << line;
}

INSTANTIATE_TEST_SUITE_P(
    BridgedGaps, AGapOfOneSide,
    ::testing::Values(
        Case{.name = "ThatGoesOn", .has_after = false},
        Case{.name = "WhoseLightEnds", .light_end = kGapBegin + 3, .has_after = false},
        Case{.name = "ThatBends", .bend_px = 3.0, .bend_at = kGapBegin + 3, .has_after = false},
        Case{.name = "WithAnOutpost",
             .has_after = false,
             .outpost = kGapEnd + 60,
             .outpost_off_px = 8.0}),
    [](const auto& tested) { return tested.param.name; });

// Where the line says little, or the edge is hardly there: more of the scan lines may be refused.
// At a bend either side speaks alone, for 8 scan lines, and few of these are sure.
class AHardGap : public ::testing::TestWithParam<Case> {};

TEST_P(AHardGap, HasItsReturnsWhereTheStripeIs) {
  Gap gap(GetParam());
  BridgedGaps gaps;
  gap.measure(gaps);
  EXPECT_GE(taken_at_the_stripe(gaps, gap), GetParam().least_bridged);
}

INSTANTIATE_TEST_SUITE_P(
    BridgedGaps, AHardGap,
    ::testing::Values(Case{.name = "OfABentStripe", .bend_px = 3.0, .least_bridged = 3},
                      Case{.name = "BesideAFaintEdge", .bright_dn = 22.0},
                      Case{.name = "WithDoubtedReturns", .own_confidence = 0.5F},
                      Case{.name = "WithDoubtedWeakReturns",
                           .own_confidence = 0.5F,
                           .status = ReturnStatus::kWeak}),
    [](const auto& tested) { return tested.param.name; });

TEST(BridgedGaps, AreDoubtfulForWhoeverAsksForMoreConfidence) {
  Gap gap({.name = "Bridged", .least_probability = 0.99999});
  BridgedGaps gaps;
  gap.measure(gaps);
  int bridged = 0;
  for (int line = kGapBegin; line < kGapEnd; ++line) {
    if (!gaps.has(line)) continue;
    ++bridged;
    EXPECT_EQ(gap.stripe().status[static_cast<std::size_t>(line)], ReturnStatus::kOutlier);
  }
  EXPECT_GE(bridged, (kGapEnd - kGapBegin) / 2);
}

TEST(BridgedGaps, AllocateNothingOnceAsManyWereThere) {
  Gap gap({"Bridged"});
  BridgedGaps gaps;
  gap.measure(gaps);
  Gap other({"Bridged"});
  const testing::AllocationCounter counter;
  other.measure(gaps);
  EXPECT_EQ(counter.count(), 0);
}

}  // namespace
}  // namespace striper::detail
