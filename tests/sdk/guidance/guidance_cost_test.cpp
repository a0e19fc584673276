// SPDX-License-Identifier: Apache-2.0
// Proves what a sweep costs: its thread's time over a million sweeps, the longest of ten thousand
// among them. On a machine that does other things beside, too: it is the thread's own time.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <vector>

#include <gtest/gtest.h>

#include <striper/guidance/guidance.hpp>
#include <striper/road/road_drive.hpp>

namespace striper {
namespace {

double thread_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

TEST(GuidanceCost, OfAMillionSweepsOneInTenThousandTakesAFifthOfAMillisecond) {
  Road road;
  road.length_m = 300.0;
  road.speeds = {{0.0, 10.0}};
  road.lines[0].dash_m = 3.0;
  road.lines[0].gap_m = 6.0;
  road.wear.edge_sd_m = 0.0076;
  road.wear.chunks_per_m = 1.5;
  RoadDrive drive(road);
  std::vector<BeamSweep> sweeps;
  std::vector<OdometerReading> readings;
  BeamSweep sweep;
  OdometerReading reading;
  for (auto next = drive.next(sweep, reading); next != RoadDrive::Next::kEnd;
       next = drive.next(sweep, reading)) {
    if (next == RoadDrive::Next::kSweep) sweeps.push_back(sweep);
    if (next == RoadDrive::Next::kOdometer) readings.push_back(reading);
  }
  GuidanceListener nobody;
  Guidance guidance(road.truck, nobody);
  constexpr std::size_t kSweeps = 1'000'000;
  std::vector<float> took_s;
  took_s.reserve(kSweeps);
  double all_s = 0.0;
  // The same road again and again: time and counts go on.
  for (int round = 0; took_s.size() < kSweeps; ++round) {
    const double offset_s = round * 30.0;
    const auto offset = static_cast<std::int64_t>(round) * 12'000;
    std::size_t next = 0;
    for (const BeamSweep& one : sweeps) {
      for (; next < readings.size() && readings[next].time_s <= one.time_s; ++next) {
        OdometerReading moved = readings[next];
        moved.time_s += offset_s;
        moved.counts += offset;
        const double before_s = thread_s();
        guidance.take(moved);
        all_s += thread_s() - before_s;
      }
      sweep = one;
      sweep.time_s += offset_s;
      const double before_s = thread_s();
      guidance.take(sweep);
      const double now_s = thread_s() - before_s;
      all_s += now_s;
      took_s.push_back(static_cast<float>(now_s));
      if (took_s.size() == kSweeps) break;
    }
  }
  const auto last = took_s.begin() + static_cast<long>(0.9999 * kSweeps);
  std::nth_element(took_s.begin(), last, took_s.end());
  const double share = 100.0 * all_s / (kSweeps / (3 * 176.0));
  std::printf("p99.99 %.3f ms; %.2f %% of a core at 176 x 3 sweeps/s, odometer and guns included\n",
              1e3 * static_cast<double>(*last), share);
  EXPECT_LE(*last, 0.2e-3F);
}

}  // namespace
}  // namespace striper
