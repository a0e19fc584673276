// SPDX-License-Identifier: Apache-2.0
// Proves, on exact geometry seen by stripers drawn from their calibration's covariance, that every
// tool measures what it says with true error bars: random ones alone, and with the calibration's.
// And that what cannot be measured says why. Rendered images are in tests/end_to_end.
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/profile/measurement_csv.hpp>
#include <striper/profile/tools.hpp>

#include "support/drawn_striper.hpp"
#include "support/error_of.hpp"
#include "support/instrumented.hpp"
#include "support/profile_scans.hpp"

namespace striper {
namespace {

using testing::DrawnStriper;
using testing::Rms;
using testing::Wall;

// How a draw of a scene differs from it, so that edges are anywhere between columns: everything
// sideways, and the first edge that counts once more.
struct Move {
  double y_m = 0.0;
  double edge_m = 0.0;
};

// What a tool row should say.
using Truth = std::map<std::string, double>;

struct Scene {
  std::vector<std::string> tools;
  std::function<double(double bearing_rad, Move move)> range;
  std::function<Truth(Move move)> truth;
};

// The last wall's first edge is the one that counts.
std::vector<Wall> moved(std::vector<Wall> walls, Move move) {
  for (Wall& wall : walls) {
    wall.a.y() += move.y_m;
    wall.b.y() += move.y_m;
  }
  walls.back().a.y() += move.edge_m;
  return walls;
}

// A board in front of a room's corner.
Scene room() {
  const std::vector<Wall> walls{
      {{2.0, -2.0}, {2.0, 0.6}}, {{2.0, 0.6}, {1.5, 1.2}}, {{1.7, -0.3}, {1.7, 0.2}}};
  return {{"wall:line:x=1.9..2.1,y=-1..-0.4", "depth:step:x=1.9..2.1,y=-1..-.4;x=1.6..1.8",
           "board:width:x=1.6..1.8,y=-.4..0.3", "bend:angle:y=.3..0.55;y=.65..1.2",
           "corner:position:y=.3..0.55;y=.65..1.2"},
          [walls](double b, Move by) { return testing::range_of_walls(b, moved(walls, by)); },
          [](Move by) {
            return Truth{{"wall.line.distance", 2.0},
                         {"wall.line.angle", 0.0},
                         {"depth.step", -0.3},
                         {"board.width", 0.5 - by.edge_m},
                         {"bend.angle", std::atan2(0.5, 0.6)},
                         {"corner.position.x", 2.0},
                         {"corner.position.y", 0.6 + by.y_m}};
          }};
}

// Two plates with a gap, a deep wall behind.
Scene plates() {
  const std::vector<Wall> walls{
      {{1.5, -0.6}, {1.5, -0.05}}, {{2.6, -3.0}, {2.6, 3.0}}, {{1.52, 0.03}, {1.52, 0.6}}};
  return {{"a:gap:x=1.3..1.7,y=-.7..0;x=1.3..1.7,y=0..0.7", "b:flush:x=1.3..1.7",
           "c:flush:x=1.3..1.7,y=0..0.7;x=1.3..1.7,y=-.7..0"},
          [walls](double b, Move by) { return testing::range_of_walls(b, moved(walls, by)); },
          [](Move by) {
            return Truth{{"a.gap", 0.08 + by.edge_m}, {"b.flush", -0.02}, {"c.flush", -0.02}};
          }};
}

// A wall with a groove, a pipe in front of it.
Scene groove_and_pipe() {
  const std::vector<Wall> walls{{{1.8, -2.0}, {1.8, -0.2}},
                                {{1.8, -0.2}, {1.9, -0.1}},
                                {{1.9, -0.1}, {1.8, 0.0}},
                                {{1.8, 0.0}, {1.8, 2.0}}};
  const auto range = [walls](double b, Move by) {
    const Eigen::Vector2d centre(1.65, 0.45 + by.y_m);
    const double across = centre.x() * std::sin(b) - centre.y() * std::cos(b);
    const double along = centre.x() * std::cos(b) + centre.y() * std::sin(b);
    constexpr double kRadius = 0.12;
    if (std::abs(across) < kRadius) return along - std::sqrt(kRadius * kRadius - across * across);
    return testing::range_of_walls(b, moved(walls, {by.y_m, 0.0}));
  };
  return {{"pipe:circle:x=1.4..1.66,y=.3..0.6", "groove:area:y=-.7..-.3;y=-.25..0.05",
           "chord:area:y=-.3..0.1"},
          range,
          [](Move by) {
            return Truth{{"pipe.circle.radius", 0.12},
                         {"pipe.circle.x", 1.65},
                         {"pipe.circle.y", 0.45 + by.y_m},
                         {"groove.area", 0.01},
                         {"chord.area", 0.01}};
          }};
}

std::vector<MeasureTool> tools_of(const Scene& scene) {
  std::vector<MeasureTool> tools;
  for (const std::string& text : scene.tools) tools.push_back(parse_measure_tool(text));
  return tools;
}

// @param is_drawn  the striper is not the model's, and sigma_cal says so.
void expect_true_bars(const Scene& scene, bool is_drawn) {
  STRIPER_SKIP_FIGURES_WHERE_INSTRUMENTED();
  constexpr int kDraws = 2000;  // Pulls are known to .016; of an area's, with its tails, to .03.
  auto model = std::make_shared<StriperModel>(testing::typical_model());
  if (is_drawn) model->covariance = testing::plausible_covariance(*model);
  Measurer measurer(tools_of(scene), model);
  std::map<std::string, Rms> pulls;
  PolarScan scan;
  for (int draw = 0; draw < kDraws; ++draw) {
    const StriperModel truth = is_drawn ? testing::drawn_model(*model) : *model;
    const Move by{testing::uniform(-0.01, 0.01), testing::uniform(-0.005, 0.005)};
    const DrawnStriper striper(*model, truth, 0.1);
    striper.scan([&](double b) { return scene.range(b, by); }, scan);
    const Truth expected = scene.truth(by);
    for (const Measurement& m : measurer.measure(scan)) {
      const auto found = expected.find(m.tool);
      if (found == expected.end() || m.status != MeasureStatus::kOk) continue;
      EXPECT_EQ(std::isfinite(m.sigma_cal), is_drawn);
      const double cal = is_drawn ? m.sigma_cal : 0.0;
      pulls[m.tool].add((m.value - found->second) / std::hypot(m.sigma, cal));
    }
  }
  for (const auto& [row, ignored] : scene.truth({})) {
    EXPECT_GE(pulls[row].count(), kDraws * 49 / 50) << row;
    EXPECT_NEAR(pulls[row].value(), 1.0, 0.1) << row;
  }
}

TEST(Measurer, RandomBarsOfARoomAreTrue) { expect_true_bars(room(), false); }
TEST(Measurer, BarsOfARoomWithTheCalibrationsAreTrue) { expect_true_bars(room(), true); }
TEST(Measurer, RandomBarsOfPlatesAreTrue) { expect_true_bars(plates(), false); }
TEST(Measurer, BarsOfPlatesWithTheCalibrationsAreTrue) { expect_true_bars(plates(), true); }
TEST(Measurer, RandomBarsOfAGrooveAndAPipeAreTrue) { expect_true_bars(groove_and_pipe(), false); }
TEST(Measurer, BarsOfAGrooveAndAPipeWithTheCalibrationsAreTrue) {
  expect_true_bars(groove_and_pipe(), true);
}

TEST(Measurer, ABowsStraightnessIsItsSagitta) {
  const testing::ProfileStriper striper;
  // An arc of 3 m radius about (4.5, 0), and the sagitta of those of its columns that are measured.
  const auto ranges = testing::exact_ranges(striper, [](double b) {
    const double along = 4.5 * std::cos(b);
    return along - std::sqrt(9.0 - 20.25 + along * along);
  });
  double half_chord = 0.0;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double y = ranges[i] * std::sin(striper.bearing_rad(i));
    if (y < 0.5) half_chord = std::max(half_chord, y);
  }
  const double sagitta = 3.0 - std::sqrt(9.0 - half_chord * half_chord);
  Measurer measurer({parse_measure_tool("bow:line:y=-.5..0.5")});
  PolarScan scan;
  Rms pull;
  for (int trial = 0; trial < 300; ++trial) {
    testing::noisy_scan(striper, ranges, scan);
    const Measurement& m = measurer.measure(scan)[2];
    ASSERT_EQ(m.tool, "bow.line.straightness");
    ASSERT_EQ(m.status, MeasureStatus::kOk);
    pull.add((m.value - sagitta) / m.sigma);
  }
  EXPECT_NEAR(pull.value(), 1.0, 0.15);
}

// A room's scan, exactly the model's striper.
PolarScan scan_of(const Scene& scene) {
  const StriperModel model = testing::typical_model();
  PolarScan scan;
  DrawnStriper(model, model, 0.1).scan([&](double b) { return scene.range(b, {}); }, scan);
  return scan;
}

MeasureStatus status_of(const char* tool, const PolarScan& scan) {
  Measurer measurer({parse_measure_tool(tool)});
  return measurer.measure(scan)[0].status;
}

TEST(Measurer, WhatCannotBeMeasuredSaysWhy) {
  const PolarScan scan = scan_of(room());
  EXPECT_EQ(status_of("a:line:x=9..10", scan), MeasureStatus::kFewPoints);
  EXPECT_EQ(status_of("a:line:y=.2..1", scan), MeasureStatus::kNoLine);  // About the corner.
  EXPECT_EQ(status_of("a:line:y=-.6..0", scan), MeasureStatus::kAmbiguous);
  EXPECT_EQ(status_of("a:line:x=1.9..2.1", scan), MeasureStatus::kOk);  // On both sides of it.
  EXPECT_EQ(status_of("a:width:x=1.6..1.8,y=-.1..0.3", scan), MeasureStatus::kOutside);
  EXPECT_EQ(status_of("a:width:x=1.6..1.8,y=-.4..0.3", scan), MeasureStatus::kOk);
  EXPECT_EQ(status_of("a:circle:x=1.9..2.1,y=-1..-.4", scan), MeasureStatus::kAmbiguous);
  EXPECT_EQ(status_of("a:position:y=.3..1.2", scan), MeasureStatus::kOk);
  PolarScan empty;
  EXPECT_EQ(status_of("a:area", empty), MeasureStatus::kFewPoints);
  EXPECT_EQ(status_of("a:gap", empty), MeasureStatus::kFewPoints);
}

TEST(Measurer, WithoutAModelThereIsNoCalibrationError) {
  Measurer measurer({parse_measure_tool("a:line:x=1.9..2.1,y=-1..-.4")});
  const Measurement& m = measurer.measure(scan_of(room()))[0];
  EXPECT_EQ(m.status, MeasureStatus::kOk);
  EXPECT_NEAR(m.value, 2.0, 5.0 * m.sigma);
  EXPECT_TRUE(std::isnan(m.sigma_cal));
}

TEST(MeasureTool, IsReadFromText) {
  const MeasureTool tool = parse_measure_tool("a:gap:x=.5..1,y=-1.5..;y=..2e-1");
  EXPECT_EQ(tool.name, "a");
  EXPECT_EQ(tool.kind, ToolKind::kGap);
  ASSERT_EQ(tool.regions.size(), 2U);
  EXPECT_EQ(tool.regions[0].x_from_m, 0.5);
  EXPECT_EQ(tool.regions[0].y_from_m, -1.5);
  EXPECT_TRUE(std::isinf(tool.regions[0].y_to_m));
  EXPECT_EQ(tool.regions[1].y_to_m, 0.2);
}

TEST(MeasureTool, NonsenseIsRefused) {
  const auto error_of = [](const char* text) {
    return std::string(testing::error_of([&] { parse_measure_tool(text); }).what());
  };
  EXPECT_EQ(error_of("a"),
            "tool 'a': expected NAME:TOOL[:REGION[;REGION]], TOOL one of line, step, gap, flush, "
            "width, angle, circle, position, area");
  EXPECT_EQ(error_of(":gap"),
            "tool ':gap': expected NAME:TOOL[:REGION[;REGION]], NAME without = , ; . and blanks");
  EXPECT_EQ(error_of("a:gap:z=1..2"), "tool 'a:gap:z=1..2': a region is x=A..B,y=C..D, in metres");
  EXPECT_EQ(error_of("a:gap:x=2..1"),
            "tool 'a:gap:x=2..1': x=2..1 is no interval: expected two numbers, the smaller one "
            "first");
  EXPECT_EQ(error_of("a:width:x=1..2;x=2..3"), "tool 'a': width takes at most 1 region, not 2");
  const std::vector<MeasureTool> twice(2, parse_measure_tool("a:line"));
  EXPECT_STREQ(testing::error_of([&] { Measurer measurer(twice); }).what(),
               "tool 'a' is there twice");
}

TEST(MeasurementCsv, IsToTheLetter) {
  std::string text;
  CsvWriter<MeasurementLine>::append_header(text, measurement_columns());
  CsvWriter<MeasurementLine>::append(
      text, measurement_columns(),
      {7, 0.25, {"a.step", 0.5, 0.001, Measurement::kNone, "m", 120, MeasureStatus::kOk}});
  EXPECT_EQ(text,
            "frame,time_s,tool,value,sigma,sigma_cal,unit,points,status\n"
            "7,0.25,a.step,0.5,0.001,,m,120,ok\n");
}

}  // namespace
}  // namespace striper
