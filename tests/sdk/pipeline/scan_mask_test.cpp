// SPDX-License-Identifier: Apache-2.0
// Proves that a region is scanned as that part of the whole image is, fields and binned pixels
// included, and that what a mask covers is never the stripe while the rest of its column is.
#include <cmath>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/pipeline/scanner.hpp>

#include "pipeline/frame_part.hpp"
#include "support/error_of.hpp"
#include "support/models.hpp"
#include "support/scratch_directory.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

double row_of(const StriperModel& model, double range_m) {
  return Triangulator(model, 0).project(range_m, 0.0).pixel.y();
}

// A wall at so many metres, its noise always the same.
Frame frame_of_wall(const StriperModel& model, double range_m) {
  testing::reseed();
  testing::SyntheticStripe stripe;
  stripe.lines = 640;
  stripe.length = 480;
  stripe.noise_dn = 1.0;
  stripe.position = [row = row_of(model, range_m)](int) { return row; };
  Frame frame;
  frame.image = testing::render(stripe).lit;
  frame.sensor_size = frame.image.size();
  return frame;
}

ScannerOptions always_on() {
  ScannerOptions options;
  options.ambient.pattern = IlluminationPattern::parse("0");
  return options;
}

ScannerOptions with_mask(ScanMask mask) {
  ScannerOptions options = always_on();
  options.mask = std::make_shared<const ScanMask>(std::move(mask));
  return options;
}

TEST(Region, IsScannedAsThatPartOfTheImage) {
  const StriperModel model = testing::paper_model();
  const Frame frame = frame_of_wall(model, 2.0);
  const cv::Rect region(100, 300, 200, 150);
  ASSERT_TRUE(region.contains(cv::Point(150, static_cast<int>(row_of(model, 2.0)))));
  Scanner all(model, always_on());
  ScannerOptions options = always_on();
  options.region = region;
  Scanner part(model, options);
  const auto whole = all.process(frame);
  const auto scans = part.process(frame);
  ASSERT_EQ(scans.size(), 1U);
  ASSERT_EQ(scans[0].returns.size(), 200U);
  for (std::size_t i = 0; i < 200; ++i) {
    const Return& seen = scans[0].returns[i];
    const Return& same = whole[0].returns[i + 100];
    ASSERT_EQ(seen.status, ReturnStatus::kOk);
    EXPECT_EQ(seen.u_px, same.u_px);
    EXPECT_NEAR(seen.v_px, same.v_px, 0.01);
    EXPECT_NEAR(seen.range_m, same.range_m, 1e-3);
  }
}

TEST(Region, OutsideOfTheSensorIsRefused) {
  ScannerOptions options = always_on();
  options.region = cv::Rect(600, 0, 41, 480);
  const Error error = testing::error_of([&] { Scanner(testing::paper_model(), options); });
  EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
  EXPECT_THAT(error.what(), HasSubstr("600,0,41,480 is not within the model's sensor of 640x480"));
}

// Of a camera that sends a region of its own, which may be elsewhere.
TEST(Region, ThatAFrameDoesNotShowRefusesTheFrame) {
  const StriperModel model = testing::paper_model();
  Frame frame = frame_of_wall(model, 2.0);
  frame.image = frame.image.colRange(320, 640);
  frame.grid = PixelGrid::region(320, 0);
  ScannerOptions options = always_on();
  options.region = cv::Rect(0, 0, 300, 480);
  Scanner scanner(model, options);
  EXPECT_TRUE(scanner.process(frame).empty());
  EXPECT_EQ(scanner.statistics().refused, 1U);
}

TEST(FramePart, HasThePixelsWhoseCentresAreInTheRegion) {
  Frame frame;
  frame.image = cv::Mat::zeros(240, 320, CV_8UC1);
  frame.grid = PixelGrid::binned(2, 2);
  const Frame part = detail::part_of(frame, {101, 50, 20, 21});
  // Centres at 0.5, 2.5, ...: from 102.5 to 118.5, and from 50.5 to 68.5.
  EXPECT_EQ(part.image.size(), cv::Size(9, 10));
  EXPECT_EQ(part.grid.sensor_u(0), 102.5);
  EXPECT_EQ(part.grid.sensor_v(9), 68.5);
}

TEST(FramePart, OfAnInterlacedFrameBeginsWithTheSameField) {
  Frame frame;
  frame.image = cv::Mat::zeros(480, 640, CV_8UC1);
  frame.field = Field::kInterlacedTopFirst;
  const Frame part = detail::part_of(frame, {0, 101, 640, 50});
  EXPECT_EQ(part.grid.sensor_v(0), 100.0);
  EXPECT_EQ(part.image.rows, 52);
}

// A brighter and longer line above the stripe, of a reflection: masked, the stripe is what is left.
class MaskedScene : public ::testing::TestWithParam<ExtractMethod> {
 protected:
  MaskedScene() : model_(testing::paper_model()), frame_(frame_of_wall(model_, 2.0)) {
    testing::SyntheticStripe reflection;
    reflection.lines = 600;
    reflection.length = 480;
    reflection.background_dn = 0.0;
    reflection.amplitude_dn = 200.0;
    reflection.position = [](int) { return static_cast<double>(kRow); };
    cv::Mat lines = frame_.image.colRange(20, 620);
    lines += testing::render(reflection).lit;
  }

  // Good returns in columns 210 to 390 that are of the stripe.
  int stripes_found(ScannerOptions options) {
    options.stripe.method = GetParam();
    Scanner scanner(model_, options);
    const auto scans = scanner.process(frame_);
    int found = 0;
    for (std::size_t i = 210; i < 390; ++i) {
      const Return& one = scans[0].returns[i];
      const bool is_stripe = std::abs(one.v_px - row_of(model_, 2.0)) < 1.0;
      found += one.status == ReturnStatus::kOk && is_stripe ? 1 : 0;
    }
    return found;
  }

  static constexpr int kRow = 250;
  StriperModel model_;
  Frame frame_;
};

TEST_P(MaskedScene, WithoutAMaskShowsTheReflection) { EXPECT_LT(stripes_found(always_on()), 90); }

TEST_P(MaskedScene, PolygonInPixels) {
  ScanMask mask;
  mask.pixels = {{{150, kRow - 8}, {450, kRow - 8}, {450, kRow + 10}, {150, kRow + 10}}};
  EXPECT_EQ(stripes_found(with_mask(mask)), 180);
}

// Beyond six metres there is nothing to be seen in the scan plane.
TEST_P(MaskedScene, PolygonInMetres) {
  ScanMask mask;
  mask.metres = {{{6, -50}, {500, -400}, {500, 400}, {6, 50}}};
  ASSERT_GT(row_of(model_, 6.0), kRow + 3);
  EXPECT_EQ(stripes_found(with_mask(mask)), 180);
}

TEST_P(MaskedScene, Image) {
  ScanMask mask;
  mask.image = cv::Mat(480, 640, CV_8UC1, cv::Scalar(255));
  mask.image.rowRange(kRow - 8, kRow + 10).setTo(0);
  EXPECT_EQ(stripes_found(with_mask(mask)), 180);
}

// A mask is of the sensor: the region moves nothing of it.
TEST_P(MaskedScene, MaskAndRegion) {
  ScanMask mask;
  mask.image = cv::Mat(480, 640, CV_8UC1, cv::Scalar(255));
  mask.image.rowRange(kRow - 8, kRow + 10).setTo(0);
  ScannerOptions options = with_mask(mask);
  options.region = cv::Rect(0, kRow - 50, 640, 250);
  EXPECT_EQ(stripes_found(options), 180);
}

INSTANTIATE_TEST_SUITE_P(Methods, MaskedScene,
                         ::testing::Values(ExtractMethod::kPaper, ExtractMethod::kRefined));

// What is masked is not the stripe though it is.
TEST(ScanMask, StripeItselfIsIgnored) {
  const StriperModel model = testing::paper_model();
  ScanMask mask;
  mask.metres = {{{1, -5}, {3, -5}, {3, 0}, {1, 0}}};  // The right half of the wall.
  Scanner scanner(model, with_mask(mask));
  const auto scans = scanner.process(frame_of_wall(model, 2.0));
  for (std::size_t i = 0; i < 640; ++i) {
    const bool is_right = i > 320;
    if (std::abs(static_cast<int>(i) - 320) < 3) continue;
    EXPECT_EQ(scans[0].returns[i].status == ReturnStatus::kOk, !is_right) << i;
  }
}

TEST(ScanMask, MetresNeedAModel) {
  ScanMask mask;
  mask.name = "bumper.yaml";
  mask.metres = {{{1, -5}, {3, -5}, {3, 0}}};
  const ScannerOptions options = with_mask(mask);
  EXPECT_STREQ(testing::error_of([&] { Scanner scanner(options); }).what(),
               "'bumper.yaml': metres: polygons of the scan plane need a model");
}

TEST(ScanMask, ImageOfAnotherSizeIsRefused) {
  ScanMask mask;
  mask.name = "mask.png";
  mask.image = cv::Mat(240, 320, CV_8UC1, cv::Scalar(255));
  const ScannerOptions options = with_mask(mask);
  EXPECT_STREQ(testing::error_of([&] { Scanner(testing::paper_model(), options); }).what(),
               "'mask.png' has 320x240 pixels, and the model's sensor 640x480");
}

class MaskFile : public ::testing::Test {
 protected:
  ScanMask load(const std::string& text) {
    std::ofstream(path_) << text;
    return load_mask(path_);
  }
  std::string refusal(const std::string& text) {
    const std::string what = testing::error_of([&] { load(text); }).what();
    return what.substr(std::min(what.find("mask.yaml"), what.size()));
  }

  testing::ScratchDirectory scratch_;
  std::filesystem::path path_ = scratch_ / "mask.yaml";
};

TEST_F(MaskFile, IsRead) {
  const ScanMask mask = load(
      "striper_mask: 1\n"
      "pixels: [[[0, 1], [2.5, 3], [4, 5]]]\n"
      "metres: [[[0.2, -0.4], [0.6, -0.4], [0.6, 0.4], [0.2, 0.4]]]\n");
  ASSERT_EQ(mask.pixels.size(), 1U);
  EXPECT_EQ(mask.pixels[0][1], cv::Point2d(2.5, 3));
  ASSERT_EQ(mask.metres.size(), 1U);
  EXPECT_EQ(mask.metres[0].size(), 4U);
}

TEST_F(MaskFile, ThatIsNoneIsRefusedByLineAndField) {
  EXPECT_THAT(refusal("pixels: []\n"), HasSubstr("striper_mask is missing - expected the version"));
  EXPECT_THAT(refusal("striper_mask: 2\n"), HasSubstr("mask.yaml:1: striper_mask"));
  EXPECT_THAT(refusal("striper_mask: 1\npixels: [[[0, 1], [2, 3]]]\n"),
              HasSubstr("mask.yaml:2: pixels[0]: a list of 2 - expected a polygon of three"));
  EXPECT_THAT(refusal("striper_mask: 1\nmeters: []\n"), HasSubstr("meters"));
  EXPECT_THAT(refusal("striper_mask: 1\npixels: [[[0, 1], [2, 3], [nan, 3]]]\n"),
              HasSubstr("mask.yaml:2: pixels[0][2]"));
  EXPECT_THAT(refusal("striper_mask: 1\npixels: [[[0, 1], [2, 3], [1e9, 3]]]\n"),
              HasSubstr("mask.yaml:2: pixels"));
}

TEST_F(MaskFile, MayBeAnImage) {
  const std::filesystem::path image = scratch_ / "mask.png";
  cv::imwrite(image, cv::Mat(48, 64, CV_8UC1, cv::Scalar(255)));
  EXPECT_EQ(load_mask(image).image.size(), cv::Size(64, 48));
  const std::filesystem::path none = scratch_ / "none.png";
  EXPECT_EQ(testing::error_of([&] { load_mask(none); }).kind(), ErrorKind::kNotFound);
}

}  // namespace
}  // namespace striper
