// SPDX-License-Identifier: Apache-2.0
// Proves that the sync check tells a locked laser (and its field) from one that slips, is always on
// or off, for interlaced, single and alternating pictures, in textured sunlight with noise, in the
// hard sun of a simulated scene, and that it measures the rate. How a real trigger looks on a real
// shutter it cannot prove.
#include <cmath>
#include <functional>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/ambient/sync_check.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 80;
constexpr std::int64_t kPeriod_ns = 33'366'667;

enum class Pictures { kInterlacedBottomFirst, kFieldsTopFirst, kProgressive };

// Renders exposures of a textured bright wall with a stripe where `is_lit` says so.
class Scene final : public FrameSource {
 public:
  Scene(Pictures pictures, std::function<bool(std::uint64_t exposure)> is_lit)
      : pictures_(pictures), is_lit_(std::move(is_lit)) {}

  SourceInfo info() const override {
    SourceInfo info;
    info.picture_rate_hz = 30000.0 / 1001.0;
    return info;
  }
  void start() override { next_ = 0; }
  void stop() override {}
  SourceStatistics statistics() const override { return {}; }

  NextStatus next(Frame& frame, std::chrono::milliseconds) override {
    frame = {};
    const std::uint64_t per_picture = pictures_ == Pictures::kProgressive ? 1 : 2;
    const bool is_interlaced = pictures_ == Pictures::kInterlacedBottomFirst;
    const std::uint64_t exposure = is_interlaced ? 2 * next_ : next_;
    ++next_;
    frame.exposures_per_picture = static_cast<int>(per_picture);
    frame.sequence = exposure / per_picture;
    frame.exposure_in_picture = static_cast<int>(exposure % per_picture);
    const double jitter_ns = testing::normal(0.0, 1e5);
    frame.time.monotonic_ns =
        static_cast<std::int64_t>(frame.sequence) * kPeriod_ns + std::llround(jitter_ns);
    frame.field_period_ns = per_picture == 2 ? kPeriod_ns / 2 : 0;
    if (is_interlaced) {
      frame.field = Field::kInterlacedBottomFirst;
      frame.image = render(0, 1, is_lit_(exposure + 1));
      const cv::Mat bottom = render(0, 1, is_lit_(exposure));
      for (int row = 1; row < kHeight; row += 2) bottom.row(row).copyTo(frame.image.row(row));
    } else if (pictures_ == Pictures::kFieldsTopFirst) {
      const int first = frame.exposure_in_picture;
      frame.field = first == 0 ? Field::kTop : Field::kBottom;
      frame.grid = first == 0 ? PixelGrid::top_field() : PixelGrid::bottom_field();
      frame.image = render(first, 2, is_lit_(exposure));
    } else {
      frame.image = render(0, 1, is_lit_(exposure));
    }
    return NextStatus::kFrame;
  }

 private:
  static cv::Mat render(int first_line, int step, bool is_lit) {
    cv::Mat image((kHeight - first_line + step - 1) / step, kWidth, CV_8UC1);
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const double line = first_line + step * row;
        const double wall = 120 + 40 * std::sin(0.15 * line + 0.05 * column);
        const double away = line - 42.3;
        const double stripe = is_lit ? 50 * std::exp(-0.5 * away * away / 2.25) : 0.0;
        image.at<std::uint8_t>(row, column) =
            cv::saturate_cast<std::uint8_t>(wall + stripe + testing::normal(0.0, 2.0));
      }
    }
    return image;
  }

  Pictures pictures_;
  std::function<bool(std::uint64_t)> is_lit_;
  std::uint64_t next_ = 0;
};

SyncReport check(Pictures pictures, std::function<bool(std::uint64_t)> is_lit) {
  Scene scene(pictures, std::move(is_lit));
  return check_sync(scene, {1.0, {}});
}

bool even(std::uint64_t exposure) { return exposure % 2 == 0; }
bool odd(std::uint64_t exposure) { return exposure % 2 == 1; }

TEST(CheckSync, LaserInTheFirstFieldOfInterlacedPicturesIsFound) {
  const SyncReport report = check(Pictures::kInterlacedBottomFirst, even);
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.pattern, IlluminationPattern::parse("0,dark"));
  EXPECT_EQ(report.lit_field, Field::kBottom);
  EXPECT_GT(report.surplus, 0.4);
}

TEST(CheckSync, LaserInTheSecondFieldIsFound) {
  const SyncReport report = check(Pictures::kInterlacedBottomFirst, odd);
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.pattern, IlluminationPattern::parse("dark,0"));
  EXPECT_EQ(report.lit_field, Field::kTop);
}

TEST(CheckSync, SingleFieldsAreComparedAtTheSameLines) {
  const SyncReport report = check(Pictures::kFieldsTopFirst, odd);
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.lit_field, Field::kBottom);
  EXPECT_EQ(report.agreeing, report.windows);
}

TEST(CheckSync, EverySecondPictureIsFound) {
  const SyncReport report = check(Pictures::kProgressive, odd);
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.pattern, IlluminationPattern::parse("dark,0"));
  EXPECT_EQ(report.lit_field, Field::kProgressive);
}

TEST(CheckSync, EveryThirdFieldIsFoundAndIsOfEitherParity) {
  const SyncReport report =
      check(Pictures::kFieldsTopFirst, [](std::uint64_t exposure) { return exposure % 3 == 0; });
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.pattern, IlluminationPattern::parse("0,dark,dark"));
  EXPECT_EQ(report.lit_field, Field::kProgressive);
}

TEST(CheckSync, LaserAlwaysOnOrOffMakesNoDifference) {
  for (const bool is_on : {false, true}) {
    for (const Pictures pictures : {Pictures::kInterlacedBottomFirst, Pictures::kProgressive}) {
      const SyncReport report = check(pictures, [=](std::uint64_t) { return is_on; });
      EXPECT_EQ(report.verdict, SyncVerdict::kNoDifference);
      EXPECT_TRUE(report.pattern.is_automatic());
    }
  }
}

// By an exposure in so many: slowly, from one of six pictures to the next, and within them.
TEST(CheckSync, TriggerThatRunsFreeSlips) {
  for (const Pictures pictures :
       {Pictures::kInterlacedBottomFirst, Pictures::kFieldsTopFirst, Pictures::kProgressive}) {
    for (const std::uint64_t steady : {7U, 9U, 13U, 20U}) {
      const SyncReport report = check(pictures, [=](std::uint64_t exposure) {
        return (exposure + exposure / steady) % 2 == 0;
      });
      EXPECT_EQ(report.verdict, SyncVerdict::kSlipping) << steady;
    }
  }
}

TEST(CheckSync, RateAndUnevennessAreMeasured) {
  const SyncReport report = check(Pictures::kInterlacedBottomFirst, even);
  EXPECT_NEAR(report.rate_hz, 30000.0 / 1001.0, 0.01);
  EXPECT_NEAR(report.jitter_ms, 0.1, 0.05);
  EXPECT_NEAR(report.nominal_rate_hz, 29.97, 0.001);
}

TEST(CheckSync, FewPicturesAreNotEnoughToTell) {
  Scene scene(Pictures::kProgressive, odd);
  EXPECT_EQ(check_sync(scene, {0.1, {}}).verdict, SyncVerdict::kTooFew);
}

TEST(CheckSync, EndsWhenItIsCancelled) {
  Scene scene(Pictures::kProgressive, odd);
  int asked = 0;
  const SyncReport report = check_sync(scene, {1e9, [&] { return ++asked > 5; }});
  EXPECT_EQ(report.windows, 0U);
}

}  // namespace
}  // namespace striper
