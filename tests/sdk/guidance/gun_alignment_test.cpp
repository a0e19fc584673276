// SPDX-License-Identifier: Apache-2.0
// Proves that valves' delays and the gun's place come out of painted ends at two speeds within 2 ms
// and with an honest sigma, the output's zero and scale out of Figure 13's readings; and that one
// speed, or one place, is refused. Does not prove that paint ends as sharply as a tape reads it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/guidance/gun_alignment.hpp>

#include "support/random.hpp"
#include "support/road_run.hpp"

namespace striper {
namespace {

using testing::RoadRun;

constexpr double kInch = 0.0254;
constexpr double kMph = 0.44704;

double noise(double sigma) { return testing::normal(0.0, sigma); }

struct Valves {
  double x_m = -0.12;
  double on_s = 0.062;
  double off_s = 0.041;
};

// What the gun paints where its signal changes so, as a tape measures it.
void paint(const RoadRun& run, double speed_m_s, const Valves& valves,
           std::vector<PaintedEnd>& ends) {
  for (const GunLine& line : run.guns) {
    if (!line.is_on || line.from_m < 1.0) continue;
    for (const bool is_on : {true, false}) {
      const double signal_m = is_on ? line.from_m : line.to_m;
      const double late_m = speed_m_s * (is_on ? valves.on_s : valves.off_s);
      ends.push_back({line.gun, is_on, signal_m, speed_m_s,
                      signal_m + valves.x_m + late_m + noise(0.005), 0.005});
    }
  }
}

std::vector<PaintedEnd> painted_at(const std::vector<double>& speeds_mph, const Valves& valves) {
  std::vector<PaintedEnd> ends;
  for (const double mph : speeds_mph) {
    Road road;
    road.length_m = 70.0;
    road.speeds = {{0.0, mph * kMph}};
    road.lines[0].dash_m = 2.0;
    road.lines[0].gap_m = 4.0;
    road.lines[0].begin_m = 4.0;
    paint(testing::guide_road(road, road.truck), mph * kMph, valves, ends);
  }
  return ends;
}

TEST(GunAlignment, FindsDelaysWithinTwoMillisecondsFromTwoSpeeds) {
  const std::vector<PaintedEnd> clean = painted_at({7.0, 28.0}, {});
  std::vector<double> pulls;
  double worst_s = 0.0;
  for (int draw = 0; draw < 100; ++draw) {
    const Valves valves{noise(0.2), 0.05 + noise(0.01), 0.05 + noise(0.01)};
    std::vector<PaintedEnd> ends = clean;
    for (PaintedEnd& end : ends) {
      const double late_s = end.is_on ? valves.on_s : valves.off_s;
      end.painted_m = end.signal_m + valves.x_m + end.speed_m_s * late_s + noise(end.sigma_m);
    }
    const std::vector<GunAlignment> guns = align_guns(ends);
    ASSERT_EQ(guns.size(), 1U);
    EXPECT_TRUE(guns[0].is_trusted);
    pulls.push_back((guns[0].on_delay_s - valves.on_s) / guns[0].sigma_on_s);
    pulls.push_back((guns[0].off_delay_s - valves.off_s) / guns[0].sigma_off_s);
    pulls.push_back((guns[0].x_m - valves.x_m) / guns[0].sigma_x_m);
    worst_s = std::max({worst_s, std::abs(guns[0].on_delay_s - valves.on_s),
                        std::abs(guns[0].off_delay_s - valves.off_s)});
  }
  std::printf("%zu ends: delays within %.2f ms, pulls %.2f\n", clean.size(), 1e3 * worst_s,
              testing::rms(pulls));
  EXPECT_LT(worst_s, 0.002);
  EXPECT_GE(testing::rms(pulls), 0.8);
  EXPECT_LE(testing::rms(pulls), 1.1);
}

TEST(GunAlignment, PaintsOnTheDashesAfterwards) {
  const Valves valves;
  Road road;
  road.length_m = 100.0;
  road.speeds = {{0.0, 8.0}};
  road.lines[0].dash_m = 3.0;
  road.lines[0].gap_m = 5.0;
  road.lines[0].begin_m = 7.0;
  GuidanceConfig config = road.truck;
  apply(align_guns(painted_at({7.0, 28.0}, valves)).front(), config);
  std::vector<PaintedEnd> ends;
  paint(testing::guide_road(road, config), 8.0, valves, ends);
  ASSERT_GE(ends.size(), 16U);
  for (const PaintedEnd& end : ends) {
    const double in_cycle_m = std::fmod(end.painted_m - 7.0 - (end.is_on ? 0.0 : 3.0) + 4.0, 8.0);
    EXPECT_NEAR(in_cycle_m, 4.0, 3 * kInch);
  }
}

TEST(GunAlignment, IsRefusedFromOneSpeed) {
  const std::vector<GunAlignment> guns = align_guns(painted_at({20.0}, {}));
  ASSERT_EQ(guns.size(), 1U);
  EXPECT_FALSE(guns[0].is_trusted);
  EXPECT_GT(guns[0].sigma_on_s, 0.01);
  GuidanceConfig config = report_truck();
  config.guns[0].name = "another";
  EXPECT_THROW(apply(guns[0], config), Error);
}

TEST(OutputAlignment, FindsTheReportsSlope) {
  std::vector<VoltsReading> readings;
  for (int half = 2; half <= 22; ++half) {
    const double lateral_m = 0.5 * half * kInch;
    readings.push_back({-0.249 / kInch * (lateral_m - 6.2 * kInch), lateral_m + noise(0.001)});
  }
  const OutputAlignment output = align_output(readings);
  EXPECT_TRUE(output.is_trusted);
  EXPECT_NEAR(output.volts_per_m * kInch, -0.249, 4 * output.sigma_volts_per_m * kInch);
  EXPECT_NEAR(output.offset_m, 6.2 * kInch, 4 * output.sigma_offset_m);
  GuidanceConfig config = report_truck();
  apply(output, config);
  EXPECT_NEAR(config.output.volts(6.2 * kInch), 0.0, 0.01);
  EXPECT_EQ(parse_guidance(format_guidance(config), "x").output.offset_sd_m, output.sigma_offset_m);

  EXPECT_FALSE(align_output(std::vector<VoltsReading>(5, {1.0, 0.2})).is_trusted);
  readings[3].lateral_m += 0.1;
  EXPECT_FALSE(align_output(readings).is_trusted);
}

}  // namespace
}  // namespace striper
