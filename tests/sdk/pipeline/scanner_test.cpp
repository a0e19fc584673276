// SPDX-License-Identifier: Apache-2.0
// Proves that the stages are put together right: one scan per lit exposure, none for dark or
// refused frames, fields triangulated with the full-sensor model, nothing allocated once warm.
#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/pipeline/scanner.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/heard.hpp"
#include "support/models.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

// The frame of a wall at `range_m` straight ahead, without noise.
Frame frame_of_wall(const StriperModel& model, double range_m) {
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
  options.ambient.pattern = IlluminationPattern::parse("0");
  return options;
}

TEST(Scanner, GivesTheRangeOfAWall) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, paper_options());
  const auto scans = scanner.process(frame_of_wall(model, 2.0));
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
  Frame frame = frame_of_wall(model, 2.0);
  frame.illumination = Illumination::dark();
  EXPECT_TRUE(scanner.process(frame).empty());
  EXPECT_EQ(scanner.statistics().dark, 1U);
}

TEST(Scanner, PatternDecidesWhichExposuresAreLit) {
  const StriperModel model = testing::paper_model();
  ScannerOptions options = paper_options();
  options.ambient.pattern = IlluminationPattern::parse("0,dark");
  Scanner scanner(model, options);
  Frame frame = frame_of_wall(model, 2.0);
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
  const testing::Heard heard;
  ScannerOptions options = paper_options();
  options.events = heard.port();
  Scanner scanner(model, options);
  Frame frame = frame_of_wall(model, 2.0);
  frame.sensor_size = {320, 240};
  EXPECT_TRUE(scanner.process(frame).empty());
  EXPECT_EQ(scanner.statistics().refused, 1U);
  ASSERT_EQ(heard.events().size(), 1U);
  EXPECT_EQ(heard.events()[0].code, EventCode("frame_refused"));
  EXPECT_THAT(heard.events()[0].message, HasSubstr("320x240"));
  EXPECT_THAT(heard.events()[0].message, HasSubstr("640x480"));
}

// Its source has said so.
TEST(Scanner, CorruptFrameIsRefusedWithoutAWord) {
  const testing::Heard heard;
  ScannerOptions options = paper_options();
  options.events = heard.port();
  Scanner scanner(options);
  Frame frame;
  frame.status = FrameStatus::kCorrupt;
  frame.status_detail = "img_3.png: truncated";
  EXPECT_TRUE(scanner.process(frame).empty());
  EXPECT_EQ(scanner.statistics().refused, 1U);
  EXPECT_TRUE(heard.events().empty());
}

std::string refusal_of(const Frame& frame) {
  const testing::Heard heard;
  ScannerOptions options;
  options.ambient.pattern = {};
  options.events = heard.port();
  Scanner scanner(options);
  EXPECT_TRUE(scanner.process(frame).empty());
  EXPECT_TRUE(scanner.finish().empty());
  EXPECT_EQ(scanner.statistics().refused, 1U);
  return heard.events().empty() ? "" : heard.events().front().message;
}

TEST(Scanner, WhatIsNoImageIsRefusedSayingWhatIsExpected) {
  Frame frame;
  EXPECT_THAT(refusal_of(frame), HasSubstr("the frame has no pixels"));
  for (const int type : {CV_32FC1, CV_8SC1, CV_8UC4, CV_16UC2}) {
    frame.image = cv::Mat::zeros(48, 64, type);
    EXPECT_THAT(refusal_of(frame), HasSubstr("expected 1 or 3 channels of 8 or 16 bits"));
  }
  frame.image = cv::Mat::zeros(48, 64, CV_16UC1);
  frame.bit_depth = 17;
  EXPECT_THAT(refusal_of(frame), HasSubstr("17 significant bits"));
}

TEST(Scanner, SingleRowIsNotTwoFields) {
  Frame frame;
  frame.image = cv::Mat::zeros(1, 640, CV_8UC1);
  frame.field = Field::kInterlacedTopFirst;
  frame.exposures_per_picture = 2;
  EXPECT_THAT(refusal_of(frame), HasSubstr("one row is not two fields"));
}

TEST(Scanner, FrameThatChangesItsSizeIsScannedAsItIs) {
  ScannerOptions options = paper_options();
  options.ambient.pattern = IlluminationPattern::parse("0,dark");
  Scanner scanner(options);
  std::size_t scans = 0;
  for (int i = 0; i < 24; ++i) {
    Frame frame;
    frame.image = cv::Mat(i % 3 == 0 ? 48 : 33, i % 5 < 2 ? 64 : 31, i % 7 < 3 ? CV_8UC1 : CV_16UC3,
                          cv::Scalar::all(20));
    frame.sequence = static_cast<std::uint64_t>(i);
    for (const PolarScan& scan : scanner.process(frame)) {
      ++scans;
      EXPECT_TRUE(scan.returns.size() == 64 || scan.returns.size() == 31);
    }
  }
  scans += scanner.finish().size();
  EXPECT_GT(scans + scanner.statistics().unpaired, 0U);
}

TEST(Scanner, PatternOfALaserThatTheModelLacksIsRefused) {
  ScannerOptions options = paper_options();
  options.ambient.pattern = IlluminationPattern::parse("0,7,dark");
  const Error error = testing::error_of([&] { Scanner(testing::paper_model(), options); });
  EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
  EXPECT_STREQ(error.what(),
               "the pattern '0,7,dark' fires laser 7, but the model has 1 laser, counted from 0");
}

// A plane that both axes can see: y points left with columns, up with rows.
TEST(Scanner, AxisOfTheOptionsRulesTheScanFrameToo) {
  StriperModel model = testing::typical_model();
  model.lasers[0].plane = LaserPlane(Eigen::Vector3d(0.5, 0.8, 0.3).normalized(), 0.4);
  StriperModel by_rows = model;
  by_rows.axis = StripeAxis::kRows;
  const Triangulator exact(by_rows, 0);
  ScannerOptions options = paper_options();
  options.stripe.axis = StripeAxis::kRows;
  Scanner scanner(model, options);
  Frame frame;
  frame.image = cv::Mat::zeros(480, 640, CV_8UC1);
  frame.image.col(500).setTo(200);
  frame.image.col(501).setTo(100);
  frame.sensor_size = frame.image.size();
  const auto scans = scanner.process(frame);
  ASSERT_EQ(scans.size(), 1U);
  const Return& seen = scans[0].returns[300];
  ASSERT_EQ(seen.status, ReturnStatus::kOk);
  const PlanePoint truth = exact.triangulate({seen.u_px, seen.v_px});
  EXPECT_NEAR(seen.y_m, truth.y_m, 1e-6);
  EXPECT_NEAR(seen.bearing_rad, truth.bearing_rad(), 1e-6);
}

StriperModel model_of_rows_in_red() {
  StriperModel model = testing::typical_model(StripeAxis::kRows);
  model.channel = Channel::kRed;
  model.difference_channel = Channel::kGrey;
  model.noise = NoiseModel{2.0, 0.1, 3.0, 8};
  return model;
}

TEST(ScannerOptions, WhatIsNotAskedForIsTheModels) {
  const StriperModel model = model_of_rows_in_red();
  const ScannerOptions options = ScannerOptions::for_model(model, ScannerOptions());
  EXPECT_EQ(options.stripe.axis, StripeAxis::kRows);
  EXPECT_EQ(options.ambient.channel, Channel::kRed);
  EXPECT_EQ(options.ambient.difference_channel, Channel::kGrey);
  EXPECT_EQ(options.stripe.noise, model.noise);
  EXPECT_EQ(options.ambient.lasers, 1);
}

TEST(ScannerOptions, WhatIsAskedForBeatsTheModelThoughItIsTheDefault) {
  ScannerOptions asked;
  asked.stripe.axis = StripeAxis::kColumns;
  asked.ambient.channel = Channel::kAuto;
  asked.stripe.noise = NoiseModel{5.0, 0.0, 0.0, 8};
  const ScannerOptions options = ScannerOptions::for_model(model_of_rows_in_red(), asked);
  EXPECT_EQ(options.stripe.axis, StripeAxis::kColumns);
  EXPECT_EQ(options.ambient.channel, Channel::kAuto);
  EXPECT_FALSE(options.ambient.difference_channel.has_value());
  EXPECT_EQ(options.stripe.noise, asked.stripe.noise);
}

// Which end is near depends on the axis that was asked for.
TEST(ScannerOptions, NearEndIsThatOfTheAxisAskedFor) {
  StriperModel model = testing::paper_model();
  model.lasers[0].plane = LaserPlane(Eigen::Vector3d(-0.5, 0.8, 0.3).normalized(), 0.4);
  ScannerOptions asked;
  asked.stripe.axis = StripeAxis::kRows;
  EXPECT_EQ(ScannerOptions::for_model(model).stripe.near_end, NearEnd::kLastPixel);
  EXPECT_EQ(ScannerOptions::for_model(model, asked).stripe.near_end, NearEnd::kFirstPixel);
}

TEST(Scanner, WithOptionsThatSayNothingIsAsTheModelSays) {
  const StriperModel model = model_of_rows_in_red();
  ScannerOptions options;
  options.ambient.pattern = IlluminationPattern::parse("0");
  Scanner scanner(model, options);
  Frame frame;
  frame.image = cv::Mat::zeros(480, 640, CV_8UC3);
  frame.image.col(500).setTo(cv::Scalar(0, 0, 200));
  frame.image.row(100).setTo(cv::Scalar(250, 250, 0));  // Brighter, along columns, not red.
  frame.sensor_size = frame.image.size();
  const auto scans = scanner.process(frame);
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].axis, StripeAxis::kRows);
  ASSERT_EQ(scans[0].returns.size(), 480U);
  EXPECT_NEAR(scans[0].returns[300].u_px, 500.0, 0.5);
}

TEST(Scanner, InterlacedFrameGivesOneScanPerLitField) {
  const StriperModel model = testing::paper_model();
  ScannerOptions options = paper_options();
  options.ambient.pattern = IlluminationPattern::parse("0,dark");
  Scanner scanner(model, options);
  Frame frame = frame_of_wall(model, 1.6);
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

// Nobody says that the laser is always on; whether it is goes on being looked for.
TEST(Scanner, FirstFrameOfALaserThatIsAlwaysOnGivesTheFirstScan) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, ScannerOptions());
  for (std::uint64_t sequence = 0; sequence < 14; ++sequence) {
    Frame frame = frame_of_wall(model, 2.0);
    frame.sequence = sequence;
    const auto scans = scanner.process(frame);
    ASSERT_EQ(scans.size(), 1U) << sequence;
    EXPECT_EQ(scans[0].sequence, sequence);
    EXPECT_EQ(scans[0].returns[320].status, ReturnStatus::kOk);
  }
  EXPECT_EQ(scanner.status().ambient.pattern, IlluminationPattern::parse("0"));
  EXPECT_TRUE(scanner.finish().empty());
}

// The second frame is dark: what follows is held until the pattern is known.
TEST(Scanner, FirstScanDoesNotSettleThePattern) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, ScannerOptions());
  std::vector<std::size_t> scans;
  for (std::uint64_t sequence = 0; sequence < 8; ++sequence) {
    Frame frame = frame_of_wall(model, 2.0);
    if (sequence % 2 == 1) frame.image.setTo(10);
    frame.sequence = sequence;
    scans.push_back(scanner.process(frame).size());
  }
  EXPECT_THAT(scans, ::testing::ElementsAre(1, 0, 0, 0, 0, 2, 0, 1));
  EXPECT_EQ(scanner.status().ambient.pattern, IlluminationPattern::parse("0,dark"));
}

TEST(Scanner, FramesHeldForThePatternComeOutAtTheEnd) {
  const StriperModel model = testing::paper_model();
  ScannerOptions options = paper_options();
  options.ambient.pattern = {};
  options.ambient.lasers = 2;  // Which of them it is the first frame does not show.
  Scanner scanner(model, options);
  EXPECT_TRUE(scanner.process(frame_of_wall(model, 2.0)).empty());
  const auto scans = scanner.finish();
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].returns[320].status, ReturnStatus::kOk);
  EXPECT_EQ(scanner.statistics().scans, 1U);
  EXPECT_EQ(scanner.status().ambient.pattern, IlluminationPattern::parse("0"));
  EXPECT_EQ(scanner.status().ambient.origin, PatternOrigin::kAssumed);
}

// What 8-bit images say of a camera's noise serves its 12-bit images: in those without a stripe
// nothing is found, whether the model says of which depth it speaks or the images show it.
TEST(Scanner, NoiseOfAnotherBitDepthMakesNoStripes) {
  testing::reseed();
  const NoiseModel of_12_bits{12.0, 0.4, 0.0, 12};
  StriperModel model = testing::paper_model();
  Frame frame = frame_of_wall(model, 2.0);
  frame.bit_depth = 12;
  frame.image = cv::Mat(frame.image.size(), CV_16UC1);
  const double noise_dn = std::sqrt(of_12_bits.variance_dn2(400.0));
  for (const std::optional<int> known : {std::optional(8), std::optional<int>()}) {
    model.noise = of_12_bits;
    model.noise->read_noise_dn /= 16.0;
    model.noise->dn_per_electron /= 16.0;
    model.noise->bit_depth = known;
    Scanner scanner(model);
    std::size_t found = 0;
    for (frame.sequence = 0; frame.sequence < 8; ++frame.sequence) {
      for (int v = 0; v < frame.image.rows; ++v) {
        for (int u = 0; u < frame.image.cols; ++u) {
          frame.image.at<std::uint16_t>(v, u) =
              static_cast<std::uint16_t>(std::lround(testing::normal(400.0, noise_dn)));
        }
      }
      for (const PolarScan& scan : scanner.process(frame)) {
        for (const Return& r : scan.returns) found += r.status == ReturnStatus::kOk ? 1 : 0;
      }
    }
    EXPECT_LE(found, 8U) << (known ? "known" : "seen");
  }
}

TEST(Scanner, MovesWithoutLosingItsState) {
  Scanner first(paper_options());
  first.process(frame_of_wall(testing::paper_model(), 2.0));
  const Scanner second = std::move(first);
  EXPECT_EQ(second.statistics().frames, 1U);
}

TEST(Scanner, AllocatesNothingOnceWarm) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, paper_options());
  const Frame frame = frame_of_wall(model, 2.0);
  for (int i = 0; i < 6; ++i) scanner.process(frame);  // The pattern is looked at in so many.
  const testing::AllocationCounter counter;
  for (int i = 0; i < 10; ++i) scanner.process(frame);
  EXPECT_EQ(counter.count(), 0U);
}

TEST(Scanner, ScansSayWhoseTheyAreAndWhere) {
  ScannerOptions options = paper_options();
  options.head = "left";
  std::shared_ptr<const PolarScan> kept;
  {
    Scanner scanner(testing::paper_model(), options);
    kept = scanner.process(frame_of_wall(testing::paper_model(), 2.0)).shared(0);
  }
  EXPECT_EQ(kept->head(), "left");
  EXPECT_EQ(kept->frame->frame_id, "left_scan0");
  EXPECT_NEAR(kept->frame->T_head_scan.translation().z(), -0.5, 1e-12);
  ASSERT_NE(kept->frame->model, nullptr);
  EXPECT_EQ(kept->frame->model->camera, testing::paper_model().camera);
  EXPECT_EQ(kept->returns[320].status, ReturnStatus::kOk);
}

TEST(Scanner, ScanThatIsKeptStaysAsItIs) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, paper_options());
  const auto kept = scanner.process(frame_of_wall(model, 2.0)).shared(0);
  const double range_m = kept->returns[320].range_m;
  for (int i = 0; i < 4; ++i) scanner.process(frame_of_wall(model, 1.5));
  EXPECT_EQ(kept->returns[320].range_m, range_m);
}

TEST(Scanner, AllocatesNothingOnceWarmWhereScansAreKeptAWhile) {
  const StriperModel model = testing::paper_model();
  Scanner scanner(model, paper_options());
  const Frame frame = frame_of_wall(model, 2.0);
  std::array<std::shared_ptr<const PolarScan>, 5> kept;
  std::size_t n = 0;
  const auto scan = [&] { kept[n++ % kept.size()] = scanner.process(frame).shared(0); };
  for (int i = 0; i < 8; ++i) scan();
  const testing::AllocationCounter counter;
  for (int i = 0; i < 10; ++i) scan();
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper
