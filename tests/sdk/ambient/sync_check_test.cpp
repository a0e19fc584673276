// SPDX-License-Identifier: Apache-2.0
// Proves that the sync check tells a locked laser (and its field) from one that slips, is always on
// or off, for interlaced, single and alternating frames, in textured sunlight with noise, in the
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

enum class Frames { kInterlacedBottomFirst, kFieldsTopFirst, kProgressive };

// Renders exposures of a textured bright wall with a stripe where `is_lit` says so.
class Scene final : public FrameSource {
 public:
  Scene(Frames frames, std::function<bool(std::uint64_t exposure)> is_lit)
      : frames_(frames), is_lit_(std::move(is_lit)) {}

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
    const std::uint64_t per_frame = frames_ == Frames::kProgressive ? 1 : 2;
    const bool is_interlaced = frames_ == Frames::kInterlacedBottomFirst;
    const std::uint64_t exposure = is_interlaced ? 2 * next_ : next_;
    ++next_;
    frame.exposures_per_picture = static_cast<int>(per_frame);
    frame.sequence = exposure / per_frame;
    frame.exposure_in_picture = static_cast<int>(exposure % per_frame);
    const double jitter_ns = testing::normal(0.0, 1e5);
    frame.time.monotonic_ns =
        static_cast<std::int64_t>(frame.sequence) * kPeriod_ns + std::llround(jitter_ns);
    frame.field_period_ns = per_frame == 2 ? kPeriod_ns / 2 : 0;
    if (is_interlaced) {
      frame.field = Field::kInterlacedBottomFirst;
      frame.image = render(0, 1, is_lit_(exposure + 1));
      const cv::Mat bottom = render(0, 1, is_lit_(exposure));
      for (int row = 1; row < kHeight; row += 2) bottom.row(row).copyTo(frame.image.row(row));
    } else if (frames_ == Frames::kFieldsTopFirst) {
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

  Frames frames_;
  std::function<bool(std::uint64_t)> is_lit_;
  std::uint64_t next_ = 0;
};

SyncReport check(Frames frames, std::function<bool(std::uint64_t)> is_lit) {
  Scene scene(frames, std::move(is_lit));
  return check_sync(scene, {1.0, {}});
}

bool even(std::uint64_t exposure) { return exposure % 2 == 0; }
bool odd(std::uint64_t exposure) { return exposure % 2 == 1; }

TEST(CheckSync, LaserInTheFirstFieldOfInterlacedFramesIsFound) {
  const SyncReport report = check(Frames::kInterlacedBottomFirst, even);
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.pattern, IlluminationPattern::parse("0,dark"));
  EXPECT_EQ(report.lit_field, Field::kBottom);
  EXPECT_GT(report.surplus, 0.4);
}

TEST(CheckSync, LaserInTheSecondFieldIsFound) {
  const SyncReport report = check(Frames::kInterlacedBottomFirst, odd);
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.pattern, IlluminationPattern::parse("dark,0"));
  EXPECT_EQ(report.lit_field, Field::kTop);
}

TEST(CheckSync, SingleFieldsAreComparedAtTheSameLines) {
  const SyncReport report = check(Frames::kFieldsTopFirst, odd);
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.lit_field, Field::kBottom);
  EXPECT_EQ(report.agreeing, report.windows);
}

TEST(CheckSync, EverySecondFrameIsFound) {
  const SyncReport report = check(Frames::kProgressive, odd);
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.pattern, IlluminationPattern::parse("dark,0"));
  EXPECT_EQ(report.lit_field, Field::kProgressive);
}

TEST(CheckSync, EveryThirdFieldIsFoundAndIsOfEitherParity) {
  const SyncReport report =
      check(Frames::kFieldsTopFirst, [](std::uint64_t exposure) { return exposure % 3 == 0; });
  EXPECT_EQ(report.verdict, SyncVerdict::kLocked);
  EXPECT_EQ(report.pattern, IlluminationPattern::parse("0,dark,dark"));
  EXPECT_EQ(report.lit_field, Field::kProgressive);
}

TEST(CheckSync, LaserAlwaysOnOrOffMakesNoDifference) {
  for (const bool is_on : {false, true}) {
    for (const Frames frames : {Frames::kInterlacedBottomFirst, Frames::kProgressive}) {
      const SyncReport report = check(frames, [=](std::uint64_t) { return is_on; });
      EXPECT_EQ(report.verdict, SyncVerdict::kNoDifference);
      EXPECT_TRUE(report.pattern.is_automatic());
    }
  }
}

// By an exposure in so many: slowly, from one of six frames to the next, and within them.
TEST(CheckSync, TriggerThatRunsFreeSlips) {
  for (const Frames frames :
       {Frames::kInterlacedBottomFirst, Frames::kFieldsTopFirst, Frames::kProgressive}) {
    for (const std::uint64_t steady : {7U, 9U, 13U, 20U}) {
      const SyncReport report = check(
          frames, [=](std::uint64_t exposure) { return (exposure + exposure / steady) % 2 == 0; });
      EXPECT_EQ(report.verdict, SyncVerdict::kSlipping) << steady;
    }
  }
}

TEST(CheckSync, RateAndUnevennessAreMeasured) {
  const SyncReport report = check(Frames::kInterlacedBottomFirst, even);
  EXPECT_NEAR(report.rate_hz, 30000.0 / 1001.0, 0.01);
  EXPECT_NEAR(report.jitter_ms, 0.1, 0.05);
  EXPECT_NEAR(report.nominal_rate_hz, 29.97, 0.001);
}

TEST(CheckSync, FewFramesAreNotEnoughToTell) {
  Scene scene(Frames::kProgressive, odd);
  EXPECT_EQ(check_sync(scene, {0.1, {}}).verdict, SyncVerdict::kTooFew);
}

TEST(CheckSync, EndsWhenItIsCancelled) {
  Scene scene(Frames::kProgressive, odd);
  int asked = 0;
  const SyncReport report = check_sync(scene, {1e9, [&] { return ++asked > 5; }});
  EXPECT_EQ(report.windows, 0U);
}

}  // namespace
}  // namespace striper
