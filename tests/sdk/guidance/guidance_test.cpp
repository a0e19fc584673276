// SPDX-License-Identifier: Apache-2.0
// Proves what guidance does when something is wrong: each fault is found within a sweep and 2 ms,
// does what the file says and goes away again; guns are off meanwhile. And its settings: double
// lines, the rear beam on fresh paint, gaps that are no faults, the report's bench (Appendix C),
// the files to the letter, the same run twice, nothing allocated, its cost. Accuracy is
// road_run_test.cpp's.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/guidance/guidance_errors.hpp>
#include <striper/guidance/scan_sweep.hpp>

#include "support/allocation_counter.hpp"
#include "support/road_run.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using testing::guide_road;
using testing::RoadFaults;
using testing::RoadRun;

constexpr double kFoot = 0.3048;
constexpr double kInch = 0.0254;
constexpr double kMph = 0.44704;
constexpr double kSweep_s = 1.0 / 176.0;

Road plain_road(double length_m = 120.0) {
  Road road;
  road.length_m = length_m;
  road.speeds = {{0.0, 10.0}};
  return road;
}

std::size_t count_of(const RoadRun& run, GuidanceFault fault) {
  return static_cast<std::size_t>(std::count_if(
      run.faults.begin(), run.faults.end(), [&](const FaultLine& f) { return f.code == fault; }));
}

// Of the fault that began around then; infinite where there is none.
double latency_s(const RoadRun& run, GuidanceFault fault, double after_s) {
  for (const FaultLine& line : run.faults) {
    if (line.code == fault && line.time_s >= after_s) return line.time_s - after_s;
  }
  return std::numeric_limits<double>::infinity();
}

bool is_any_on(const RoadRun& run, double from_m, double to_m) {
  return std::any_of(run.guns.begin(), run.guns.end(), [&](const GunLine& line) {
    return line.is_on && line.to_m > from_m && line.from_m < to_m;
  });
}

struct Recorder : GuidanceListener {
  void fault(const FaultLine& line) override { faults.push_back(line); }
  void switch_laser_off(double time_s) override { off_s = time_s; }
  std::vector<FaultLine> faults;
  double off_s = -1.0;
};

TEST(GuidanceFaults, ASoundRunHasNone) {
  EXPECT_TRUE(guide_road(plain_road(), report_truck()).faults.empty());
}

TEST(GuidanceFaults, ABeamThatFallsSilentIsMissedWithinASweep) {
  RoadFaults silent;
  silent.sweep = [](BeamSweep& s) {
    return s.beam != "middle" || s.time_s < 5.0 || s.time_s > 6.0;
  };
  const RoadRun run = guide_road(plain_road(), report_truck(), silent);
  EXPECT_EQ(count_of(run, GuidanceFault::kBeamSilent), 1U);
  EXPECT_LE(latency_s(run, GuidanceFault::kBeamSilent, 5.0), kSweep_s + 0.0025);
  EXPECT_TRUE(is_any_on(run, 51.0, 59.0));  // Others go on: it is only said.
}

TEST(GuidanceFaults, ABeamThatNeverBeginsIsMissedAfterASecond) {
  RoadFaults silent;
  silent.sweep = [](BeamSweep& s) { return s.beam == "front"; };
  const RoadRun run = guide_road(plain_road(), report_truck(), silent);
  EXPECT_EQ(count_of(run, GuidanceFault::kBeamSilent), 1U);
  EXPECT_LE(latency_s(run, GuidanceFault::kBeamSilent, 0.0), 1.0 + 2.0 * kSweep_s);
}

// The odometer goes on: guidance goes on by it, blind, until the gap is too long.
TEST(GuidanceFaults, WhereAllBeamsFallSilentTheStripeIsMissedAndVoltsAreSafe) {
  RoadFaults silent;
  silent.sweep = [](BeamSweep& s) { return s.time_s < 5.0; };
  const GuidanceConfig config = report_truck();
  const RoadRun run = guide_road(plain_road(), config, silent);
  ASSERT_EQ(count_of(run, GuidanceFault::kNoStripe), 1U);
  // At 10 m/s; the gun's own place was last seen through the beams' reach.
  EXPECT_LE(latency_s(run, GuidanceFault::kNoStripe, 5.0),
            config.stripe.gap_limit_m / 10.0 + 3 * kSweep_s);
  EXPECT_GT(run.points.back().line.distance_m, 110.0);
  EXPECT_EQ(run.points.back().line.state, PathState::kFault);
  EXPECT_EQ(run.points.back().line.volts, config.output.volts_safe);
  for (std::size_t i = 1; i < run.points.size(); ++i) {
    ASSERT_LE(run.points[i].line.time_s - run.points[i - 1].line.time_s, 2 * kSweep_s + 0.004);
  }
  EXPECT_FALSE(is_any_on(run, 60.0, 120.0));
  for (const GunLine& line : run.guns) EXPECT_GE(line.length_m, 0.0) << line.from_m;
}

TEST(GuidanceFaults, ABlindBeamIsSeenAtItsSweep) {
  for (const double value : {0.0, 4095.0}) {
    RoadFaults blind;
    blind.sweep = [&](BeamSweep& s) {
      if (s.beam == "front" && s.time_s > 5.0 && s.time_s < 5.5) s.samples.assign(142, value);
      return true;
    };
    const RoadRun run = guide_road(plain_road(), report_truck(), blind);
    EXPECT_EQ(count_of(run, GuidanceFault::kBeamBlind), 1U) << value;
    EXPECT_LE(latency_s(run, GuidanceFault::kBeamBlind, 5.0), 2 * kSweep_s) << value;
  }
}

TEST(GuidanceFaults, ASilentOdometerStopsTheGuns) {
  RoadFaults silent;
  silent.odometer = [](OdometerReading& r) { return r.time_s < 5.0 || r.time_s > 6.0; };
  const RoadRun run = guide_road(plain_road(), report_truck(), silent);
  EXPECT_GE(count_of(run, GuidanceFault::kOdometer), 1U);
  EXPECT_LE(latency_s(run, GuidanceFault::kOdometer, 5.0), kSweep_s + 0.006);
  EXPECT_FALSE(is_any_on(run, 51.0, 59.5));
  EXPECT_TRUE(is_any_on(run, 64.0, 70.0));  // The line goes on, and so does the gun.
  const auto in_fault = std::find_if(run.points.begin(), run.points.end(), [](const auto& p) {
    return p.line.state == PathState::kFault;
  });
  ASSERT_NE(in_fault, run.points.end());
  EXPECT_EQ(in_fault->line.volts, 0.0);
}

TEST(GuidanceFaults, ARunThatStopsForSecondsHasItsGunsOff) {
  RoadFaults stops;
  stops.odometer = [](OdometerReading& r) { return r.time_s < 5.0 || r.time_s > 9.0; };
  stops.sweep = [](BeamSweep& s) { return s.time_s < 5.0 || s.time_s > 9.0; };
  const RoadRun run = guide_road(plain_road(), report_truck(), stops);
  EXPECT_LE(latency_s(run, GuidanceFault::kOdometer, 5.0), 0.01);
  EXPECT_FALSE(is_any_on(run, 51.0, 91.0));  // Nothing was seen of what lies there.
  EXPECT_TRUE(is_any_on(run, 95.0, 110.0));
}

TEST(GuidanceFaults, ATimeOfAnotherWorldDoesNotHoldItUp) {
  Recorder recorder;
  Guidance guidance(report_truck(), recorder);
  guidance.take(OdometerReading{0.0, 0, std::numeric_limits<double>::quiet_NaN()});
  guidance.take(BeamSweep{0.0, 0, "front", std::vector<double>(142, 60.0)});
  guidance.take(BeamSweep{1e12, 0, "front", std::vector<double>(142, 60.0)});
  guidance.take(OdometerReading{2e12, 0, std::numeric_limits<double>::quiet_NaN()});
  guidance.finish();
  EXPECT_FALSE(recorder.faults.empty());
}

TEST(GuidanceFaults, AnOdometerThatJumpsIsOne) {
  RoadFaults jumps;
  jumps.odometer = [](OdometerReading& r) {
    if (r.time_s > 5.0 && r.time_s < 5.01) r.counts += 5000;
    return true;
  };
  const RoadRun run = guide_road(plain_road(), report_truck(), jumps);
  EXPECT_GE(count_of(run, GuidanceFault::kOdometer), 1U);
}

TEST(GuidanceFaults, NoStripeIsOneBeyondTheGapLimitOnly) {
  for (const double speed_mph : {3.0, 40.0}) {
    Road road = plain_road(speed_mph < 10 ? 45.0 : 120.0);
    road.speeds = {{0.0, speed_mph * kMph}};
    road.lines[0].dash_m = 12.0;
    road.lines[0].gap_m = 9.0;
    EXPECT_EQ(count_of(guide_road(road, report_truck()), GuidanceFault::kNoStripe), 0U)
        << speed_mph;
  }
  Road ends = plain_road();
  ends.lines[0].end_m = 60.0;
  const RoadRun run = guide_road(ends, report_truck());
  EXPECT_EQ(count_of(run, GuidanceFault::kNoStripe), 1U);
  EXPECT_FALSE(is_any_on(run, 61.0, 117.0));
  EXPECT_EQ(run.points.back().line.state, PathState::kFault);
}

TEST(GuidanceFaults, TimeThatGoesBackIsSaidAndSurvived) {
  RoadFaults back;
  back.sweep = [](BeamSweep& s) {
    if (s.time_s > 5.0 && s.time_s < 5.006) s.time_s -= 1.0;
    return true;
  };
  const RoadRun run = guide_road(plain_road(), report_truck(), back);
  EXPECT_GE(count_of(run, GuidanceFault::kTime), 1U);
  EXPECT_TRUE(is_any_on(run, 60.0, 110.0));
}

// The system's clock is set back by three seconds, for all inputs.
TEST(GuidanceFaults, AClockThatIsSetBackHasItsGunsOffUntilItIsThereAgain) {
  RoadFaults back;
  back.sweep = [](BeamSweep& s) {
    if (s.time_s > 5.0) s.time_s -= 3.0;
    return true;
  };
  back.odometer = [](OdometerReading& r) {
    if (r.time_s > 5.0) r.time_s -= 3.0;
    return true;
  };
  const RoadRun run = guide_road(plain_road(), report_truck(), back);
  ASSERT_TRUE(is_any_on(run, 40.0, 50.0));
  EXPECT_EQ(count_of(run, GuidanceFault::kTime), 1U);
  for (const GunLine& line : run.guns) {
    const bool was_on_then = line.is_on && line.from_m < 50.0;
    EXPECT_LT(was_on_then ? line.to_m : 0.0, 50.2);  // At 10 m/s.
  }
  EXPECT_TRUE(is_any_on(run, 55.0, 90.0));  // The way of those seconds is not known.
}

TEST(GuidanceFaults, ASampleThatIsNoNumberBlindsABeamForThatSweep) {
  RoadFaults broken;
  broken.sweep = [](BeamSweep& s) {
    if (s.time_s > 5.0 && s.time_s < 5.012) s.samples[40] = std::nan("");
    return true;
  };
  Road dashes = plain_road();
  dashes.lines[0].dash_m = 3.0;
  dashes.lines[0].gap_m = 3.0;
  const RoadRun run = guide_road(dashes, report_truck(), broken);
  const RoadRun sound = guide_road(dashes, report_truck());
  EXPECT_GE(count_of(run, GuidanceFault::kBeamBlind), 1U);
  for (const char* beam : {"front", "middle"}) {  // Who look for ends.
    EXPECT_GE(sound.count(SeenKind::kStart, beam), 15U);
    EXPECT_EQ(run.count(SeenKind::kStart, beam), sound.count(SeenKind::kStart, beam)) << beam;
  }
}

TEST(GuidanceFaults, AMirrorThatSpinsUpIsNotWrong) {
  Recorder recorder;
  Guidance guidance(report_truck(), recorder);
  double time_s = 0.0;
  const auto see = [&](double mirror_hz) {
    guidance.take(TruckState{time_s += 0.1, 1, mirror_hz});
  };
  for (double hz = 3.0; hz < 22.0; hz += 2.0) see(hz);
  for (int i = 0; i < 10; ++i) see(22.0);
  EXPECT_LT(recorder.off_s, 0.0);
  see(20.0);
  EXPECT_EQ(recorder.off_s, time_s);
}

TEST(GuidanceFaults, AMirrorThatStandsSwitchesTheLaserOff) {
  Recorder recorder;
  Guidance guidance(report_truck(), recorder);
  guidance.take(TruckState{0.0, 1, 22.0});
  guidance.take(TruckState{0.1, 1, 22.3});
  EXPECT_TRUE(recorder.faults.empty() ||
              recorder.faults.front().code == GuidanceFault::kBeamSilent);
  guidance.take(TruckState{0.2, 1, 0.0});
  EXPECT_EQ(recorder.off_s, 0.2);
  EXPECT_EQ(recorder.faults.back().code, GuidanceFault::kMirror);
  guidance.take(TruckState{0.3, 0, 22.0});
  EXPECT_EQ(recorder.faults.back().code, GuidanceFault::kLaserOff);
}

TEST(GuidanceFaults, ActionsAreTheFiles) {
  Road road = plain_road();
  road.lines[0].end_m = 60.0;
  GuidanceConfig config = report_truck();
  config.faults[static_cast<std::size_t>(GuidanceFault::kNoStripe)] = FaultAction::kHold;
  const RoadRun hold = guide_road(road, config);
  const double held = hold.points.back().line.volts;
  const auto last_known = std::find_if(hold.points.rbegin(), hold.points.rend(), [](const auto& p) {
    return p.line.state != PathState::kFault;
  });
  EXPECT_EQ(held, last_known->line.volts);
  config.faults[static_cast<std::size_t>(GuidanceFault::kNoStripe)] = FaultAction::kWarn;
  EXPECT_EQ(guide_road(road, config).points.back().line.state, PathState::kLost);
}

TEST(Guidance, FollowsEitherOfADoubleLine) {
  Road road = plain_road(200.0);
  road.wander = {{0.05, 40.0, 0.0}};
  road.lines = {RoadLine{}, RoadLine{}};
  road.lines[1].line = 1;
  road.lines[1].lateral_m = -0.2032;
  road.lines[1].dash_m = 3.0;
  road.lines[1].gap_m = 6.0;
  road.lines[1].begin_m = 6.0;
  GuidanceConfig left = report_truck();
  left.stripe.follow = FollowLine::kLeft;
  left.stripe.lines = {GuidanceLine{}, GuidanceLine{}};
  left.guns.push_back(left.guns[0]);
  left.guns[0].name = "left";
  left.guns[1].name = "right";
  left.guns[1].line = 1;
  const RoadRun run = guide_road(road, left);
  EXPECT_LE(testing::rms(run.errors_m()), 0.1 * kInch);
  EXPECT_EQ(run.totals.guns[0].dashes, 1U);
  EXPECT_NEAR(static_cast<double>(run.totals.guns[1].dashes), 22.0, 1.0);
  EXPECT_NEAR(run.totals.guns[1].cycle_m, 9.0, 0.05);

  // The right one: the road's line 0 is what the truth is of.
  std::swap(road.lines[0].line, road.lines[1].line);
  GuidanceConfig right = left;
  right.stripe.follow = FollowLine::kRight;
  EXPECT_LE(testing::rms(guide_road(road, right).errors_m()), 0.1 * kInch);
}

TEST(Guidance, FreshPaintUnderTheRearBeamDoesNotFeedBack) {
  Road road = plain_road(1000.0);
  road.speeds = {{0.0, 25 * kMph}};
  road.wander = {{3 * kInch, 200 * kFoot, 0.0}};
  road.wear.edge_sd_m = 0.3 * kInch;
  road.wear.chunks_per_m = 1.5;
  GuidanceConfig config = report_truck();
  config.beams[2].use = BeamUse::kOldOnly;
  const RoadRun run = guide_road(road, config, {}, true);
  std::vector<double> first;
  std::vector<double> last;
  for (const auto& p : run.points) {
    if (p.line.distance_m > 25 && p.line.distance_m < 250) first.push_back(p.error_m);
    if (p.line.distance_m > 750) last.push_back(p.error_m);
  }
  std::printf(
      "fresh paint: %.3f in at first, %.3f in at last; %d seen wet\n", testing::rms(first) / kInch,
      testing::rms(last) / kInch,
      static_cast<int>(std::count_if(run.seen.begin(), run.seen.end(),
                                     [](const SeenLine& s) { return s.kind == SeenKind::kWet; })));
  EXPECT_LE(testing::rms(last), 1.25 * testing::rms(first));
  EXPECT_LE(testing::rms(last), 0.1 * kInch);
}

// Appendix C: a baffle turned by a motor, 600 turns a minute, 100 counts a turn, cuts the beam;
// 11.725 counts a foot. On for .65 of a turn.
TEST(Guidance, GivesTheReportsBench) {
  GuidanceConfig config = report_truck();
  config.guns[0].gun.x_m = 0.0;
  config.stripe.dash_min_m = 0.0;
  config.odometer.start_speed_m_s = 58.15 * kMph;
  const double counts_per_s = 1000.0;
  const double on_counts = 65.0;
  struct Bench : GuidanceListener {
    void gun(const GunLine& line) override { lines.push_back(line); }
    std::vector<GunLine> lines;
  } bench;
  config.beams.resize(1);
  Guidance guidance(config, bench);
  BeamSweep sweep;
  sweep.beam = "front";
  std::mt19937 random(3);
  std::normal_distribution<double> noise(60.0, 8.0);
  std::int64_t reading = 0;
  for (int k = 0; k < 176 * 8; ++k) {
    const double time_s = k / 176.0;
    for (; static_cast<double>(reading) / 1000.0 <= time_s; ++reading) {
      guidance.take(OdometerReading{static_cast<double>(reading) / 1000.0,
                                    reading * static_cast<std::int64_t>(counts_per_s) / 1000,
                                    std::numeric_limits<double>::quiet_NaN()});
    }
    sweep.time_s = time_s;
    sweep.samples.assign(142, 0.0);
    const bool is_open = std::fmod(counts_per_s * time_s, 100.0) < on_counts;
    for (std::size_t i = 0; i < 142; ++i) {
      sweep.samples[i] = std::round(noise(random)) + (is_open && i >= 63 && i < 79 ? 4000.0 : 0.0);
    }
    guidance.take(sweep);
  }
  ASSERT_GE(bench.lines.size(), 100U);
  std::set<long> on;
  std::set<long> off;
  for (std::size_t i = 8; i < bench.lines.size(); ++i) {
    const GunLine& line = bench.lines[i];
    (line.is_on ? on : off).insert(line.to_counts - line.from_counts);
    EXPECT_EQ(line.from_counts, bench.lines[i - 1].to_counts);
    EXPECT_NEAR(line.total_m, line.length_m + bench.lines[i - 1].length_m, 1e-9);
  }
  const double varies_ft = static_cast<double>(*on.rbegin() - *on.begin()) / 11.725;
  std::printf("bench: ON %ld to %ld counts, OFF %ld to %ld, ON varies by %.3f ft\n", *on.begin(),
              *on.rbegin(), *off.begin(), *off.rbegin(), varies_ft);
  // Printed: ON 63 to 70, OFF 33 to 39 counts, which vary by one sweep, 5.68 counts, and a count:
  // 7 counts, .597 ft.
  EXPECT_GE(*on.begin(), 62);
  EXPECT_LE(*on.rbegin(), 70);
  EXPECT_GE(*off.begin(), 33);
  EXPECT_LE(*off.rbegin(), 40);
  EXPECT_NEAR(varies_ft, 0.597, 0.001);
}

TEST(Guidance, SaysTheSameTwice) {
  const Road road = plain_road(60.0);
  const RoadRun one = guide_road(road, report_truck());
  const RoadRun two = guide_road(road, report_truck());
  ASSERT_EQ(one.points.size(), two.points.size());
  for (std::size_t i = 5; i < one.points.size(); ++i) {
    ASSERT_EQ(one.points[i].line.lateral_m, two.points[i].line.lateral_m) << i;
    ASSERT_EQ(one.points[i].line.sigma_m, two.points[i].line.sigma_m) << i;
  }
}

struct Recorded {
  std::vector<BeamSweep> sweeps;
  std::vector<OdometerReading> readings;
};

Recorded record(const Road& road) {
  Recorded recorded;
  RoadDrive drive(road);
  BeamSweep sweep;
  OdometerReading reading;
  for (auto next = drive.next(sweep, reading); next != RoadDrive::Next::kEnd;
       next = drive.next(sweep, reading)) {
    if (next == RoadDrive::Next::kSweep) recorded.sweeps.push_back(sweep);
    if (next == RoadDrive::Next::kOdometer) recorded.readings.push_back(reading);
  }
  return recorded;
}

void replay(Guidance& guidance, const Recorded& recorded) {
  std::size_t next = 0;
  for (const BeamSweep& sweep : recorded.sweeps) {
    for (; next < recorded.readings.size() && recorded.readings[next].time_s <= sweep.time_s;
         ++next) {
      guidance.take(recorded.readings[next]);
    }
    guidance.take(sweep);
  }
}

TEST(Guidance, AllocatesNothingAndCostsLittle) {
  Road road = plain_road(200.0);
  road.lines[0].dash_m = 3.0;
  road.lines[0].gap_m = 6.0;
  const Recorded recorded = record(road);
  GuidanceListener nobody;
  Guidance guidance(report_truck(), nobody);
  const std::size_t warm = recorded.sweeps.size() / 4;
  Recorded first{{recorded.sweeps.begin(), recorded.sweeps.begin() + static_cast<long>(warm)}, {}};
  const double until_s = first.sweeps.back().time_s;
  Recorded rest{{recorded.sweeps.begin() + static_cast<long>(warm), recorded.sweeps.end()}, {}};
  for (const OdometerReading& r : recorded.readings) {
    (r.time_s <= until_s ? first : rest).readings.push_back(r);
  }
  replay(guidance, first);
  const testing::AllocationCounter counter;
  const std::clock_t before = std::clock();
  replay(guidance, rest);
  const double used_s = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  EXPECT_EQ(counter.count(), 0U);
  const double took_s = rest.sweeps.back().time_s - until_s;
  std::printf("guidance: %.2f %% of a core at 176 x 3 sweeps/s, %.1f us a sweep\n",
              100 * used_s / took_s, 1e6 * used_s / static_cast<double>(rest.sweeps.size()));
}

TEST(GuidanceFile, IsReadAsItWasWritten) {
  GuidanceConfig config = report_truck();
  config.beams[1].use = BeamUse::kOldOnly;
  config.beams[2].response = {0.8, 1.0, 0.7};
  config.beams[2].threshold = std::numeric_limits<double>::quiet_NaN();
  config.guns[0].gun.on_delay_s = 0.05;
  config.stripe.follow = FollowLine::kRight;
  config.stripe.lines = {{LinePattern::kDashed, 3.0, 9.0}, {LinePattern::kSolid}};
  config.smoothing = {PathMethod::kReport, 0.9};
  config.faults[0] = FaultAction::kHold;
  const std::string text = format_guidance(config);
  EXPECT_EQ(format_guidance(parse_guidance(text, "guidance.yaml")), text);
}

TEST(GuidanceFile, RefusesWhatMakesNoSenseByItsPlace) {
  const std::string head = "striper_guidance: 1\nodometer: {counts_per_m: 38.5}\nbeams:\n";
  const auto complaint = [&](const std::string& beams) {
    try {
      parse_guidance(head + beams, "guidance.yaml");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(complaint("  - {name: a, x_m: 2.4}\n"), "");
  EXPECT_NE(complaint("  - {name: a, x_m: 2.4, kind: laser}\n").find("guidance.yaml:4"),
            std::string::npos);
  EXPECT_NE(complaint("  - {name: a, x_m: 2.4, wide: 3}\n").find("wide"), std::string::npos);
  EXPECT_NE(complaint("  - {name: a, x_m: 99}\n").find("x_m"), std::string::npos);
  EXPECT_NE(complaint("  - {name: a, x_m: 1}\n  - {name: a, x_m: 2}\n").find("two beams"),
            std::string::npos);
  EXPECT_NE(complaint("  - {name: a, x_m: 2.4, sweep_s: .nan}\n"), "");
  EXPECT_NE(complaint("  []\n").find("0 beams"), std::string::npos);
}

TEST(SweepTable, IsReadAsItWasWrittenAndRefusesRubbish) {
  const testing::ScratchDirectory scratch;
  const std::string file = (scratch.path() / "sweeps.csv").string();
  {
    SweepWriter writer(file, 4);
    writer.add({1.25, 7, "front", {1, 2, 3, 4}});
    writer.add({1.5, 9, "rear", {5.5, 6}});
    writer.close();
  }
  SweepReader reader = open_sweeps_csv(file);
  BeamSweep sweep;
  ASSERT_TRUE(reader.next(sweep));
  EXPECT_EQ(sweep.beam, "front");
  EXPECT_EQ(sweep.samples, (std::vector<double>{1, 2, 3, 4}));
  ASSERT_TRUE(reader.next(sweep));
  EXPECT_EQ(sweep.odometer_counts, 9);
  EXPECT_EQ(sweep.samples, (std::vector<double>{5.5, 6}));
  EXPECT_FALSE(reader.next(sweep));

  const auto complaint = [](const std::string& text) {
    try {
      SweepReader broken(CsvInput::of_text("sweeps.csv", text));
      BeamSweep one;
      while (broken.next(one)) {
      }
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string header = "time_s,odometer_counts,beam,s0,s1\n";
  EXPECT_EQ(complaint(header + "1,2,front,3,4\n"), "");
  EXPECT_EQ(complaint(header + "1,2,front,3,\n"), "");
  EXPECT_EQ(complaint(header + "1,2,front,3,4"), "");  // Cut off.
  EXPECT_NE(complaint("time_s,beam\n").find("expected time_s"), std::string::npos);
  EXPECT_NE(complaint(header + "x,2,front,3,4\n").find("line 2"), std::string::npos);
  EXPECT_NE(complaint(header + "1,2,front,3,x\n").find("s1"), std::string::npos);
  EXPECT_NE(complaint(header + "1,2,front,3,4,5\n").find("6 cells"), std::string::npos);
  EXPECT_NE(complaint(header + "1,2,,3,4\n").find("beam"), std::string::npos);
}

TEST(ScanSweep, ShowsPaintWhereTheScanHasIt) {
  PolarScan scan;
  for (int i = 0; i < 400; ++i) {
    Return r;
    r.status = ReturnStatus::kOk;
    r.y_m = 0.5 - i * 0.0025;
    r.intensity_dn = std::abs(r.y_m - 0.1) < 0.05 ? 200.0F : 50.0F;
    if (std::abs(r.y_m + 0.3) < 0.05) r.status = ReturnStatus::kWeak;  // A hole.
    scan.returns.push_back(r);
  }
  GuidanceBeam beam;
  beam.name = "front";
  beam.samples = 181;
  BeamSweep sweep;
  ASSERT_TRUE(sweep_of_scan(scan, beam, sweep));
  for (int i = 0; i < beam.samples; ++i) {
    const double off_m = std::abs(beam.lateral_m(i) - 0.1);
    if (off_m > 0.045 && off_m < 0.055) continue;
    EXPECT_EQ(sweep.samples[static_cast<std::size_t>(i)], off_m < 0.05 ? 200.0 : 50.0) << i;
  }
  scan.returns.clear();
  EXPECT_FALSE(sweep_of_scan(scan, beam, sweep));
}

TEST(GuidanceErrors, AreWhatTheyWereMadeToBe) {
  std::vector<RoadTruth> truth;
  for (int i = 0; i <= 4000; ++i) {
    const double d_m = 0.01 * i;
    truth.push_back({d_m, 0.1 * d_m, d_m >= 10 && d_m < 13 ? 1 : 0, 0});
  }
  std::vector<LateralLine> lateral;
  for (int i = 0; i < 390; ++i) {
    LateralLine line;
    line.distance_m = 0.1 * i + 0.05;
    line.lateral_m = 0.1 * line.distance_m + 0.005;
    line.sigma_m = 0.0025;
    lateral.push_back(line);
  }
  std::vector<GunLine> guns(4);
  guns[1] = {"gun", true, 0, 0, 10.02, 12.97, 0, 0};
  guns[2] = {"gun", true, 0, 0, 30.0, 31.0, 0, 0};
  const GuidanceErrors errors = guidance_errors(lateral, guns, truth);
  EXPECT_EQ(errors.all.rows, 30U);
  EXPECT_NEAR(errors.all.mean_m, 0.005, 1e-9);
  EXPECT_NEAR(errors.all.pull, 2.0, 1e-9);
  EXPECT_EQ(errors.all.within, 1.0);
  ASSERT_EQ(errors.ends.size(), 2U);
  EXPECT_NEAR(errors.ends[0].error_m(), 0.025, 1e-6);
  EXPECT_NEAR(errors.ends[1].error_m(), -0.025, 1e-6);
  EXPECT_EQ(errors.invented, 2U);
  EXPECT_THROW(guidance_errors(lateral, guns, {}), Error);
}

}  // namespace
}  // namespace striper
