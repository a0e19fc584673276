// SPDX-License-Identifier: Apache-2.0
// Proves that the stages are put together right: one scan per lit exposure, none for dark or
// refused frames, fields triangulated with the full-sensor model, nothing allocated once warm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/pipeline/scanner.hpp>

#include "support/allocation_counter.hpp"
#include "support/models.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

// The picture of a wall at `range_m` straight ahead, without noise.
Frame picture_of_wall(const StriperModel& model, double range_m) {
  const Triangulator exact(model, 0);
  testing::SyntheticStripe stripe;
  stripe.lines = 640;
  stripe.length = 480;
  stripe.position = [row = exact.project(range_m, 0.0).pixel.y()](int) { return row; };
  Frame frame;
  frame.image = testing::render(stripe).lit;
  frame.sensor_size = frame.image.size();
  return frame;
}

ScannerOptions paper_options() {
  ScannerOptions options;
  options.stripe.method = ExtractMethod::kPaper;
  options.ambient.cadence = Cadence::parse("0");
  return options;
}

TEST(Scanner, GivesTheRangeOfAWall) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, paper_options());
  const auto scans = scanner.process(picture_of_wall(model, 2.0));
  ASSERT_EQ(scans.size(), 1U);
  ASSERT_EQ(scans[0].returns.size(), 640U);
  const Return& ahead = scans[0].returns[320];
  EXPECT_EQ(ahead.status, ReturnStatus::kOk);
  EXPECT_LT(ahead.range_near_m, 2.0);
  EXPECT_GT(ahead.range_far_m, 2.0);
}

TEST(Scanner, DarkExposureGivesNoScanAndIsCounted) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, paper_options());
  Frame frame = picture_of_wall(model, 2.0);
  frame.illumination = Illumination::dark();
  EXPECT_TRUE(scanner.process(frame).empty());
  EXPECT_EQ(scanner.statistics().dark, 1U);
}

TEST(Scanner, CadenceDecidesWhichExposuresAreLit) {
  const StriperModel model = testing::paper_model();
  ScannerOptions options = paper_options();
  options.ambient.cadence = Cadence::parse("0,dark");
  Scanner scanner(model, options);
  Frame frame = picture_of_wall(model, 2.0);
  std::size_t scans = 0;
  for (const std::uint64_t sequence : {0U, 1U, 2U, 5U, 7U, 8U}) {
    frame.sequence = sequence;
    scans += scanner.process(frame).size();
  }
  scans += scanner.finish().size();
  EXPECT_EQ(scans, 3U);
  EXPECT_EQ(scanner.statistics().dark, 3U);
}

TEST(Scanner, FrameOfAnotherSizeIsRefusedWithBothSizes) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, paper_options());
  Frame frame = picture_of_wall(model, 2.0);
  frame.sensor_size = {320, 240};
  EXPECT_TRUE(scanner.process(frame).empty());
  EXPECT_EQ(scanner.statistics().refused, 1U);
  EXPECT_THAT(scanner.last_refusal(), HasSubstr("320x240"));
  EXPECT_THAT(scanner.last_refusal(), HasSubstr("640x480"));
}

TEST(Scanner, CorruptFrameIsRefusedWithItsOwnReason) {
  Scanner scanner(paper_options());
  Frame frame;
  frame.status = FrameStatus::kCorrupt;
  frame.status_detail = "img_3.png: truncated";
  EXPECT_TRUE(scanner.process(frame).empty());
  EXPECT_EQ(scanner.last_refusal(), "img_3.png: truncated");
}

TEST(Scanner, WovenPictureGivesOneScanPerLitField) {
  const StriperModel model = testing::paper_model();
  ScannerOptions options = paper_options();
  options.ambient.cadence = Cadence::parse("0,dark");
  Scanner scanner(model, options);
  Frame frame = picture_of_wall(model, 1.6);
  frame.field = Field::kInterlacedBottomFirst;
  frame.exposures_per_picture = 2;
  for (int row = 0; row < frame.image.rows; row += 2) frame.image.row(row).setTo(10);
  const auto scans = scanner.process(frame);
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].field, Field::kBottom);
  const Return& ahead = scans[0].returns[320];
  EXPECT_LT(ahead.range_near_m, 1.6);
  EXPECT_GT(ahead.range_far_m, 1.6);
}

TEST(Scanner, PicturesHeldForTheCadenceComeOutAtTheEnd) {
  const StriperModel model = testing::paper_model();
  ScannerOptions options = paper_options();
  options.ambient.cadence = {};
  Scanner scanner(model, options);
  EXPECT_TRUE(scanner.process(picture_of_wall(model, 2.0)).empty());
  const auto scans = scanner.finish();
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].returns[320].status, ReturnStatus::kOk);
  EXPECT_EQ(scanner.statistics().scans, 1U);
  EXPECT_THAT(scanner.decisions(), HasSubstr("cadence 0 (no dark exposure seen)"));
}

TEST(Scanner, MovesWithoutLosingItsState) {
  Scanner first(paper_options());
  first.process(picture_of_wall(testing::paper_model(), 2.0));
  const Scanner second = std::move(first);
  EXPECT_EQ(second.statistics().frames, 1U);
}

TEST(Scanner, AllocatesNothingOnceWarm) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, paper_options());
  const Frame frame = picture_of_wall(model, 2.0);
  for (int i = 0; i < 3; ++i) scanner.process(frame);
  const testing::AllocationCounter counter;
  for (int i = 0; i < 10; ++i) scanner.process(frame);
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper
