// SPDX-License-Identifier: Apache-2.0
// Proves: a scan goes through its message and back to the bit; status numbers are those that were
// promised; a point cloud has every scan line at its offsets; a LaserScan holds on each bearing of
// its grid what the naive search finds, +inf and NaN apart; nothing is allocated in a stream.
#include <bit>
#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/geometry/triangulator.hpp>
#include <striper/stream/messages/scan_messages.hpp>
#include <striper/wire/return_code.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/models.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using striper::testing::error_of;
using striper::testing::uniform;
using ::testing::HasSubstr;

constexpr float kInf = std::numeric_limits<float>::infinity();

ReturnStatus any_status() {
  return static_cast<ReturnStatus>(static_cast<int>(uniform(0.0, kReturnStatusCount)));
}

/// Returns in no order of bearing, some without a range.
PolarScan random_scan(std::size_t lines) {
  PolarScan scan;
  auto frame = std::make_shared<ScanFrame>();
  frame->frame_id = "striper_scan0";
  scan.frame = frame;
  scan.sequence = 12345678901;
  scan.time = {1'234'567'890'123, 1'700'000'000'000'000'000};
  scan.laser = 2;
  scan.field = Field::kBottom;
  scan.axis = StripeAxis::kRows;
  scan.returns.resize(lines);
  for (Return& value : scan.returns) {
    value.status = any_status();
    value.u_px = uniform(0.0, 2000.0);
    if (verdict(value.status) == Verdict::kMissing) continue;
    value.bearing_rad = uniform(-0.7, 0.7);
    value.range_m = uniform(0.3, 5.0);
    value.range_near_m = value.range_m - 0.1;
    value.range_far_m = std::numeric_limits<double>::infinity();
    value.sigma_m = uniform(0.0, 0.01);
    value.x_m = value.range_m * std::cos(value.bearing_rad);
    value.y_m = value.range_m * std::sin(value.bearing_rad);
    value.intensity_dn = static_cast<float>(uniform(0.0, 255.0));
    value.confidence = static_cast<float>(uniform(0.0, 1.0));
  }
  return scan;
}

TEST(ScanMessage, ComesBackToTheBit) {
  const PolarScan scan = random_scan(640);
  wire::PolarScan message;
  to_message(scan, message);
  EXPECT_EQ(message.header.frame_id, "striper_scan0");
  EXPECT_EQ(message.header.stamp, (wire::Time{1'700'001'234, 567'890'123}));
  PolarScan back = random_scan(700);
  from_message(message, back);
  EXPECT_EQ(back.sequence, scan.sequence);
  EXPECT_EQ(back.time.monotonic_ns, scan.time.monotonic_ns);
  EXPECT_EQ(back.time.utc_offset_ns, scan.time.utc_offset_ns);
  EXPECT_EQ(back.laser, scan.laser);
  EXPECT_EQ(back.field, scan.field);
  EXPECT_EQ(back.axis, scan.axis);
  // Every field of Return, whatever is added to it: its bytes, of which its last are padding.
  ASSERT_EQ(back.returns.size(), scan.returns.size());
  constexpr std::size_t kBytes = offsetof(Return, status) + sizeof(ReturnStatus);
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    EXPECT_EQ(std::memcmp(&back.returns[i], &scan.returns[i], kBytes), 0) << i;
  }
}

TEST(ScanMessage, WithoutAClockHasNoOffset) {
  PolarScan scan;
  scan.time = {-1, std::nullopt};
  wire::PolarScan message;
  to_message(scan, message);
  EXPECT_FALSE(message.has_utc);
  EXPECT_EQ(message.header.stamp, (wire::Time{-1, 999'999'999}));
  EXPECT_EQ(message.header.frame_id, "");
  from_message(message, scan);
  EXPECT_EQ(scan.time.utc_offset_ns, std::nullopt);
}

TEST(ScanMessage, ThatIsNoneIsRefused) {
  wire::PolarScan message;
  to_message(random_scan(5), message);
  PolarScan scan;
  const auto refusal = [&](auto change) {
    wire::PolarScan changed = message;
    change(changed);
    const Error error = error_of([&] { from_message(changed, scan); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
    return std::string(error.what());
  };
  EXPECT_THAT(refusal([](auto& m) { m.x_m.pop_back(); }),
              HasSubstr("an array of 4 beside 5 of status"));
  EXPECT_THAT(refusal([](auto& m) { m.status[1] = 14; }),
              HasSubstr("status 14 stands for nothing"));
  EXPECT_THAT(refusal([](auto& m) { m.field = 5; }), HasSubstr("field 5"));
  EXPECT_THAT(refusal([](auto& m) { m.axis = 2; }), HasSubstr("axis 2"));
}

TEST(ReturnCode, IsThePromisedOne) {
  const std::vector<std::string> words = {
      "ok",           "saturated", "ambiguous", "wide",   "narrow",        "weak",   "edge",
      "out_of_range", "no_stripe", "blind",     "behind", "outside_model", "filled", "outlier"};
  ASSERT_EQ(words.size(), static_cast<std::size_t>(kReturnStatusCount));
  for (std::size_t code = 0; code < 256; ++code) {
    const auto status = wire::return_status_from_code(static_cast<std::uint8_t>(code));
    EXPECT_EQ(status.has_value(), code < words.size()) << code;
    if (!status) continue;
    EXPECT_EQ(to_string(*status), words[code]);
    EXPECT_EQ(wire::return_code(*status), code);
  }
}

TEST(PointCloudMessage, HasEveryLineAtItsOffsets) {
  const PolarScan scan = random_scan(50);
  wire::PointCloud2 message;
  to_message(scan, message);
  EXPECT_EQ(message.width, 50U);
  EXPECT_EQ(message.data.size(), 50U * 36);
  ASSERT_EQ(message.fields.size(), 9U);
  EXPECT_EQ(message.fields[5].name, "sigma_cal");
  EXPECT_EQ(message.fields[5].offset, 20U);
  EXPECT_EQ(message.fields[8].offset, 32U);
  for (std::size_t i = 0; i < 50; ++i) {
    const Return& value = scan.returns[i];
    const auto number = [&](std::size_t field) {
      float read = 0.0F;
      std::memcpy(&read, message.data.data() + 36 * i + 4 * field, 4);
      return std::bit_cast<std::uint32_t>(read);
    };
    const auto bits = [](double expected) {
      return std::bit_cast<std::uint32_t>(static_cast<float>(expected));
    };
    const double z = std::isnan(value.x_m) ? value.x_m : 0.0;
    const double expected[] = {value.x_m,          value.y_m,       z,
                               value.intensity_dn, value.sigma_m,   value.sigma_cal_m,
                               value.width_px,     value.confidence};
    for (std::size_t field = 0; field < 8; ++field)
      EXPECT_EQ(number(field), bits(expected[field])) << field;
    EXPECT_EQ(message.data[36 * i + 32], wire::return_code(value.status));
  }
}

/// What a bearing holds, by looking at every return.
float naive_range(const PolarScan& scan, const LaserScanGrid& grid, int bearing) {
  const Return* nearest = nullptr;
  double least = 1.0;
  for (const Return& value : scan.returns) {
    const double distance =
        std::abs((value.bearing_rad - grid.angle_min_rad) / grid.increment_rad() - bearing);
    if (!(distance <= least)) continue;
    nearest = &value;
    least = distance;
  }
  if (nearest == nullptr) return kInf;
  const bool is_good = verdict(nearest->status) == Verdict::kGood;
  return is_good ? static_cast<float>(nearest->range_m) : std::numeric_limits<float>::quiet_NaN();
}

TEST(LaserScanMaker, HoldsOnEachBearingTheNearestReturn) {
  const LaserScanGrid grid{-0.6, 0.5, 200};
  LaserScanMaker maker(grid);
  wire::LaserScan message;
  int kinds[3] = {};
  for (int trial = 0; trial < 20; ++trial) {
    const PolarScan scan = random_scan(80);
    maker.to_message(scan, message);
    ASSERT_EQ(message.ranges.size(), 200U);
    ASSERT_EQ(message.intensities.size(), 200U);
    for (int bearing = 0; bearing < 200; ++bearing) {
      const float expected = naive_range(scan, grid, bearing);
      const float read = message.ranges[static_cast<std::size_t>(bearing)];
      EXPECT_EQ(std::bit_cast<std::uint32_t>(read), std::bit_cast<std::uint32_t>(expected))
          << bearing;
      ++kinds[std::isnan(expected) ? 0 : std::isinf(expected) ? 1 : 2];
    }
  }
  for (const int count : kinds) EXPECT_GT(count, 50);
  EXPECT_FLOAT_EQ(message.angle_min + 199 * message.angle_increment, message.angle_max);
}

// What the inverse, from the plane to the pixel, says of the grid.
TEST(MakeLaserScanGrid, SpansTheBearingsThatPixelsSee) {
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    const StriperModel model = striper::testing::typical_model(axis);
    // A corner of the sensor, every second pixel.
    const PixelGrid pixels = PixelGrid::region(100, 60).then(PixelGrid::binned(2, 2));
    const cv::Size size(200, 150);
    const LaserScanGrid grid = make_laser_scan_grid(model, 0, pixels, size, 0.5, 4.0);
    EXPECT_EQ(grid.bearings, axis == StripeAxis::kColumns ? 200 : 150);
    const Triangulator triangulator(model, 0);
    const auto is_seen = [&](double bearing_rad, double range_m) {
      const Projection seen =
          triangulator.project(range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad));
      if (seen.status != CameraStatus::kOk) return false;
      const double u = pixels.u.index(seen.pixel.x());
      const double v = pixels.v.index(seen.pixel.y());
      return u >= 0 && u <= size.width - 1 && v >= 0 && v <= size.height - 1;
    };
    const double margin = grid.increment_rad();
    int seen = 0;
    for (int trial = 0; trial < 20000; ++trial) {
      const double bearing_rad = uniform(-1.5, 1.5);
      if (!is_seen(bearing_rad, uniform(0.5, 4.0))) continue;
      ++seen;
      EXPECT_GT(bearing_rad, grid.angle_min_rad - margin);
      EXPECT_LT(bearing_rad, grid.angle_max_rad + margin);
    }
    EXPECT_GT(seen, 100);
    for (const double end_rad : {grid.angle_min_rad + margin, grid.angle_max_rad - margin}) {
      bool is_any = false;
      for (double range_m = 0.5; range_m <= 4.0; range_m += 0.002)
        is_any = is_any || is_seen(end_rad, range_m);
      EXPECT_TRUE(is_any) << end_rad;
    }
  }
}

TEST(MakeLaserScanGrid, WithoutAPixelWithinTheLimitsIsRefused) {
  const StriperModel model = striper::testing::typical_model();
  EXPECT_EQ(error_of([&] {
              make_laser_scan_grid(model, 0, {}, {640, 480}, 0.01, 0.02);
            }).kind(),
            ErrorKind::kUntrustworthy);
  EXPECT_EQ(error_of([&] {
              make_laser_scan_grid(model, 1, {}, {640, 480});
            }).kind(),
            ErrorKind::kBadValue);
}

TEST(LaserScanMaker, OfTwoReturnsAsNearTakesTheCloser) {
  PolarScan scan;
  scan.returns.resize(2);
  for (Return& value : scan.returns) {
    value.status = ReturnStatus::kOk;
    value.bearing_rad = 0.1;
  }
  scan.returns[0].range_m = 3.0;
  scan.returns[1].range_m = 2.0;
  LaserScanMaker maker({0.0, 0.2, 3});
  wire::LaserScan message;
  maker.to_message(scan, message);
  EXPECT_EQ(message.ranges[1], 2.0F);
}

TEST(LaserScanMaker, RefusesAGridThatIsNone) {
  EXPECT_EQ(error_of([] { LaserScanMaker({0.0, 0.1, 1}); }).kind(), ErrorKind::kBadValue);
  EXPECT_EQ(error_of([] { LaserScanMaker({0.1, 0.1, 5}); }).kind(), ErrorKind::kBadValue);
  EXPECT_EQ(error_of([] { LaserScanMaker({std::nan(""), 0.1, 5}); }).kind(), ErrorKind::kBadValue);
}

TEST(ScanMessages, AllocateNothingInAStream) {
  PolarScan scan = random_scan(640);
  wire::PolarScan whole;
  wire::PointCloud2 points;
  wire::LaserScan laser;
  LaserScanMaker maker({-0.6, 0.5, 640});
  const auto pass = [&] {
    to_message(scan, whole);
    from_message(whole, scan);
    to_message(scan, points);
    maker.to_message(scan, laser);
  };
  pass();
  const striper::testing::AllocationCounter counter;
  pass();
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper
