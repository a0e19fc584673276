// SPDX-License-Identifier: Apache-2.0
// Proves, on exact geometry plus the noise of docs/accuracy.md: an object's closing speed is found
// by its third scan with true error bars; identities, zones, existence and own motion are right; a
// scan has one time. Real vehicles are in objects_real_test.cpp; no rendered frames here.
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/detect/objects.hpp>

#include "support/allocation_counter.hpp"
#include "support/profile_scans.hpp"
#include "support/road_scans.hpp"

namespace striper {
namespace {

using Eigen::Vector2d;
using testing::ProfileStriper;
using testing::Rms;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kKmh = 1.0 / 3.6;
constexpr double kFrame_s = 1.0 / 30.0;
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// A straight face in the scan plane.
struct Face {
  Vector2d from, to;
  Face moved(const Vector2d& by) const { return {from + by, to + by}; }
};

/// A face across x, as of a vehicle that comes from ahead.
Face across(double x, double y, double width) {
  return {{x, y - 0.5 * width}, {x, y + 0.5 * width}};
}

double range_to(const Face& face, double bearing) {
  const Vector2d ray(std::cos(bearing), std::sin(bearing));
  const Vector2d along = face.to - face.from;
  const double det = ray.x() * along.y() - ray.y() * along.x();
  if (std::abs(det) < 1e-12) return kNothing;
  const double range = (face.from.x() * along.y() - face.from.y() * along.x()) / det;
  const double part = (face.from.x() * ray.y() - face.from.y() * ray.x()) / det;
  return range > 0.0 && part >= 0.0 && part <= 1.0 ? range : kNothing;
}

PolarScan scan_of(const std::vector<Face>& faces, double time_s, double row_sigma_px = 0.1) {
  ProfileStriper striper;
  striper.row_sigma_px = row_sigma_px;
  PolarScan scan;
  scan.time = FrameTime::at_seconds(time_s);
  const auto ranges = testing::exact_ranges(striper, [&](double bearing) {
    double nearest = kNothing;
    for (const Face& face : faces) {
      const double range = range_to(face, bearing);
      if (!(range >= nearest) && range > 0.0) nearest = range;
    }
    return nearest;
  });
  noisy_scan(striper, ranges, scan);
  return scan;
}

/// Turned and shifted as a sensor at `pose` sees what stands in the world.
Face seen_from(const Vector2d& sensor, double yaw, const Face& face) {
  const Eigen::Rotation2Dd back(-yaw);
  return {back * (face.from - sensor), back * (face.to - sensor)};
}

TEST(ObjectTracker, KnowsTheSpeedOfWhatComesAt100KmhByTheThirdScan) {
  constexpr double kSpeed = 100.0 * kKmh;
  Rms pull, error;
  double worst_sigma = 0.0;
  int inside = 0;
  int missed = 0;
  for (int seed = 0; seed < 300; ++seed) {
    ObjectTracker tracker;
    const double start = 4.0 - testing::uniform(0.0, 0.1);
    const double side = testing::uniform(-0.3, 0.3);
    std::span<const ObjectTrack> tracks;
    for (int k = 0; k < 3; ++k) {
      tracks =
          tracker.update(scan_of({across(start - kSpeed * kFrame_s * k, side, 1.0)}, kFrame_s * k));
    }
    if (tracks.size() != 1 || tracks[0].hits != 3) {
      ++missed;
      continue;
    }
    const ObjectTrack& t = tracks[0];
    worst_sigma = std::max(worst_sigma, t.sigma_v_m_s);
    error.add(t.closing_m_s - kSpeed);
    pull.add((t.closing_m_s - kSpeed) / t.sigma_closing_m_s);
    const double contact = (start - kSpeed * kFrame_s * 2.0) / kSpeed;
    inside += t.ttc_low_s <= contact && contact <= t.ttc_high_s ? 1 : 0;
  }
  RecordProperty("rms_m_s", std::to_string(error.value()));
  EXPECT_EQ(missed, 0);
  EXPECT_LE(worst_sigma, 0.15);
  EXPECT_LE(error.value(), 0.15);
  EXPECT_GE(pull.value(), 0.8) << error.value();
  EXPECT_LE(pull.value(), 1.3) << error.value();
  EXPECT_GE(inside, 300 * 90 / 100);
  EXPECT_LE(inside, 300 * 99 / 100);
}

TEST(ObjectTracker, ErrorBarsStayTrueForWhatAcceleratesAsTheOptionsSay) {
  const double sigma = ObjectOptions().acceleration_m_s2;
  Rms pull;
  for (int seed = 0; seed < 200; ++seed) {
    ObjectTracker tracker;
    double x = 4.0;
    double speed = testing::uniform(2.0, 6.0);
    std::span<const ObjectTrack> tracks;
    for (int k = 0; k < 12; ++k) {
      tracks = tracker.update(scan_of({across(x, 0.0, 0.5)}, kFrame_s * k));
      if (k == 11) break;
      const double acceleration = testing::normal(0.0, sigma);
      x -= speed * kFrame_s + 0.5 * acceleration * kFrame_s * kFrame_s;
      speed += acceleration * kFrame_s;
    }
    ASSERT_EQ(tracks.size(), 1U);
    pull.add((tracks[0].closing_m_s - speed) / tracks[0].sigma_closing_m_s);
  }
  EXPECT_GE(pull.value(), 0.8);
  EXPECT_LE(pull.value(), 1.3);
}

TEST(ObjectTracker, FollowsWhatBrakesAtOnce) {
  // 10 m/s for 6 scans, then 8 m/s^2 of braking: .27 m/s a scan, and it lags by less than two.
  for (int seed = 0; seed < 20; ++seed) {
    ObjectTracker tracker;
    for (int k = 0; k < 14; ++k) {
      const double braking_s = std::max(0.0, kFrame_s * (k - 6));
      const double x = 4.5 - 10.0 * kFrame_s * k + 4.0 * braking_s * braking_s;
      const auto tracks = tracker.update(scan_of({across(x, 0.0, 0.8)}, kFrame_s * k));
      ASSERT_EQ(tracks.size(), 1U);
      if (k < 9) continue;
      EXPECT_NEAR(tracks[0].closing_m_s, 10.0 - 8.0 * braking_s, 0.5) << k;
    }
  }
}

TEST(ObjectTracker, TheSecondScanGivesAVelocityAndNotZero) {
  ObjectTracker tracker;
  tracker.update(scan_of({across(4.0, 0.0, 1.0)}, 0.0));
  const auto tracks = tracker.update(scan_of({across(4.0 - 20.0 * kFrame_s, 0.0, 1.0)}, kFrame_s));
  ASSERT_EQ(tracks.size(), 1U);
  EXPECT_NEAR(tracks[0].closing_m_s, 20.0, 4.0 * tracks[0].sigma_closing_m_s);
  EXPECT_LE(tracks[0].sigma_closing_m_s, 0.4);
}

TEST(ObjectTracker, WhatGoesAcrossAt50KmhIsOneTrack) {
  constexpr double kSpeed = 50.0 * kKmh;
  for (int seed = 0; seed < 50; ++seed) {
    ObjectTracker tracker;
    std::set<std::uint64_t> ids;
    int seen = 0;
    Rms error;
    for (int k = 0; k < 8; ++k) {
      const double y = -1.6 + kSpeed * kFrame_s * k;
      const auto tracks =
          tracker.update(scan_of({across(3.5, y, 0.5), across(6.0, 0.0, 20.0)}, kFrame_s * k));
      for (const ObjectTrack& t : tracks) {
        if (!t.is_seen || t.position_m.x() > 4.5) continue;
        ids.insert(t.id);
        ++seen;
        if (t.hits > 2 && t.is_fully_observed) error.add(t.velocity_m_s.y() - kSpeed);
      }
    }
    EXPECT_EQ(ids.size(), 1U);
    EXPECT_GE(seen, 7);
    EXPECT_GE(error.count(), 3);
    EXPECT_LE(error.value(), 0.5);
  }
}

TEST(ObjectTracker, AlongAWallOnlyTheNormalIsObserved) {
  // The wall is wider than the view, at 30 degrees; it comes nearer and slides along itself.
  ObjectTracker tracker;
  const Vector2d normal(std::cos(30.0 * kDegree), std::sin(30.0 * kDegree));
  const Vector2d along(-normal.y(), normal.x());
  std::span<const ObjectTrack> tracks;
  for (int k = 0; k < 8; ++k) {
    const Vector2d foot = (3.0 - 5.0 * kFrame_s * k) * normal + 7.0 * kFrame_s * k * along;
    tracks = tracker.update(scan_of({{foot - 30.0 * along, foot + 30.0 * along}}, kFrame_s * k));
  }
  ASSERT_EQ(tracks.size(), 1U);
  EXPECT_FALSE(tracks[0].is_fully_observed);
  EXPECT_NEAR(tracks[0].observable_rad, 30.0 * kDegree, 0.5 * kDegree);
  EXPECT_NEAR(tracks[0].velocity_m_s.dot(normal), -5.0, 0.1);
  EXPECT_NEAR(tracks[0].velocity_m_s.dot(along), 0.0, 0.05);
  EXPECT_NEAR(tracks[0].closing_m_s, 5.0, 0.1);
}

TEST(ObjectTracker, TakesTheOwnMotionOut) {
  // A post and a walker, seen from a vehicle that drives a left bend.
  ObjectOptions options;
  options.mount_m = {1.5, 0.2};
  ObjectTracker tracker(options);
  const Vector2d walk(0.0, 1.4);
  Rms post, walker, closing;
  Vector2d axle(0.0, 0.0);
  for (int k = 0; k < 12; ++k) {
    const double time = kFrame_s * k;
    const double yaw = 0.5 * time;
    const double speed = 8.0;
    axle = (speed / 0.5) * Vector2d(std::sin(yaw), 1.0 - std::cos(yaw));
    const Vector2d sensor = axle + Eigen::Rotation2Dd(yaw) * options.mount_m;
    const auto face = [&](double x, double y, double width, const Vector2d& v) {
      return seen_from(sensor, yaw, across(x, y, width).moved(v * time));
    };
    Motion motion;
    motion.time_s = time;
    motion.distance_m = speed * time;
    motion.speed_m_s = speed;
    motion.yaw_rad = yaw;
    motion.yaw_rate_rad_s = 0.5;
    const auto tracks = tracker.update(
        scan_of({face(6.0, 1.2, 0.2, {0, 0}), face(6.5, -0.3, 0.4, walk)}, time), motion);
    for (const ObjectTrack& t : tracks) {
      if (k < 6 || !t.is_fully_observed) continue;
      const bool is_walker = t.width_m > 0.3;
      (is_walker ? walker : post)
          .add((t.velocity_m_s - Eigen::Rotation2Dd(-yaw) * (is_walker ? walk : Vector2d(0, 0)))
                   .norm());
      if (!is_walker) closing.add(t.closing_m_s / speed);
    }
  }
  EXPECT_GE(post.count(), 5);
  EXPECT_GE(walker.count(), 5);
  EXPECT_LE(post.value(), 0.4);
  EXPECT_LE(walker.value(), 0.4);
  EXPECT_NEAR(closing.value(), 1.0, 0.05);
}

TEST(ObjectTracker, AnObjectInEverySecondScanOnlyMakesNoLastingTrack) {
  // A wrong illumination pattern shows what moved between lit and dark as an object.
  for (int seed = 0; seed < 20; ++seed) {
    ObjectTracker tracker;
    int longest = 0;
    for (int k = 0; k < 60; ++k) {
      std::vector<Face> faces{across(6.0, 0.0, 20.0)};
      if (k % 2 == 0) faces.push_back(across(3.0, 0.3, 0.5));
      for (const ObjectTrack& t : tracker.update(scan_of(faces, kFrame_s * k))) {
        if (t.position_m.x() > 4.5) continue;
        longest = std::max(longest, t.scans);
        EXPECT_LT(t.confidence, 0.7);
      }
    }
    EXPECT_LE(longest, 4);
  }
}

TEST(ObjectTracker, ConfidenceRisesOnAHitFallsOnAClearLookAndStaysWhenHidden) {
  ObjectTracker tracker;
  double time = 0.0;
  const Face object = across(3.5, 0.0, 0.4);
  const auto look = [&](const std::vector<Face>& faces) -> double {
    const auto tracks = tracker.update(scan_of(faces, time));
    time += kFrame_s;
    return tracks.empty() ? 0.0 : tracks.front().confidence;
  };
  const Face wall = across(6.0, 0.0, 20.0);
  const auto look_object = [&](std::vector<Face> faces) {
    faces.push_back(wall);
    tracker.update(scan_of(faces, time));
    time += kFrame_s;
  };
  double before = look({object});
  EXPECT_LT(before, 0.5);
  for (int k = 0; k < 4; ++k) {
    const double now = look({object});
    EXPECT_GT(now, before);
    before = now;
  }
  EXPECT_GT(before, 0.95);
  const double hidden = look({across(1.5, 0.0, 1.0)});
  EXPECT_DOUBLE_EQ(hidden, before);
  look_object({});  // Only the wall behind it.
  const double clear = look({wall});
  EXPECT_LT(clear, before);
}

TEST(ObjectTracker, AWalkerBeyondTheCurbIsBehindIt) {
  int behind = 0;
  int road = 0;
  int scans = 0;
  const CurbEdge curb{{0.0, 0.8}, {0.0, 1.0}, 0.01};
  for (int seed = 0; seed < 20; ++seed) {
    ObjectTracker tracker;
    tracker.set_curbs({&curb, 1});
    for (int k = 0; k < 20; ++k) {
      const double x = 3.5 - 1.4 * kFrame_s * k;
      const auto tracks =
          tracker.update(scan_of({across(x, 1.15, 0.4), across(x, -0.4, 0.4)}, kFrame_s * k));
      ++scans;
      for (const ObjectTrack& t : tracks) {
        behind += t.position_m.y() > 0.5 && t.zone == ObjectZone::kBehindCurb ? 1 : 0;
        road += t.position_m.y() < 0.5 && t.zone == ObjectZone::kRoad ? 1 : 0;
      }
    }
  }
  EXPECT_GE(behind, scans * 99 / 100);
  EXPECT_GE(road, scans * 99 / 100);
  ObjectTracker without;
  EXPECT_EQ(without.update(scan_of({across(3.0, 1.15, 0.4)}, 0.0))[0].zone, ObjectZone::kUnknown);
}

// Who walks on the road hides the curb; it was seen before, so nobody takes him for being behind
// it, nor loses his side.
TEST(ObjectTracker, AWalkerBeforeAKnownCurbIsOnTheRoad) {
  testing::RoadStriper road;
  const testing::RoadProfile curb = testing::curb_profile(1.6, 0.12);
  testing::RoadProfile with_walker{{-1.0, 0.0}, {1.2, 0.0}, {1.2, 1.6}, {1.5, 1.6}};
  CurbDetectorOptions options;
  options.curb.up_rad = road.up_rad();
  CurbDetector street(options);
  ObjectTracker tracker;
  int known = 0;
  int seen = 0;
  for (int k = 0; k < 40; ++k) {
    const bool is_walked = k >= 20;
    PolarScan scan;
    testing::road_scan(road, ranges_of_profile(road, is_walked ? with_walker : curb), scan);
    scan.time = FrameTime::at_seconds(kFrame_s * k);
    street.update(scan);
    tracker.set_street(street);
    for (const ObjectTrack& t : tracker.update(scan)) {
      if (!is_walked || !t.is_seen) continue;
      ++seen;
      known += t.zone == ObjectZone::kRoad ? 1 : 0;
    }
  }
  EXPECT_GE(seen, 19);
  EXPECT_EQ(known, seen);
}

TEST(ObjectTracker, AllReturnsOfAFlashAreOfOneTime) {
  // What moves fast across is as wide as it is, and where it is at the scan's time, whichever way
  // it goes: a scanner with skew would stretch or squeeze it by speed times sweep.
  for (const double speed : {-28.0, 28.0}) {
    ObjectTracker tracker;
    for (int k = 0; k < 3; ++k) {
      const double y = speed * kFrame_s * (k - 1);
      const auto tracks = tracker.update(scan_of({across(3.5, y, 0.6)}, kFrame_s * k, 0.01));
      const double spacing = 3.5 * 55.0 * kDegree / 640.0;
      for (const ObjectTrack& t : tracks) {
        if (!t.is_seen) continue;
        EXPECT_NEAR(t.width_m, 0.6, 2.0 * spacing) << speed;
      }
    }
  }
}

TEST(ObjectTracker, CostsBelowAMillisecondAndAllocatesNothing) {
  ObjectTracker tracker;
  std::vector<PolarScan> scans;
  for (int k = 0; k < 200; ++k) {
    std::vector<Face> faces{across(6.0, 0.0, 20.0)};
    for (int i = 0; i < 8; ++i)
      faces.push_back(across(3.0 + 0.2 * i - 0.01 * k, -1.4 + 0.4 * i, 0.15));
    scans.push_back(scan_of(faces, kFrame_s * k));
  }
  for (int k = 0; k < 50; ++k) tracker.update(scans[static_cast<std::size_t>(k)]);
  const testing::AllocationCounter allocations;
  double best = 1.0;
  for (std::size_t k = 50; k < 200; ++k) {
    const auto start = std::chrono::steady_clock::now();
    tracker.update(scans[k]);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    best = std::min(best, taken.count());
  }
  EXPECT_EQ(allocations.count(), 0U);
  RecordProperty("best_us", std::to_string(best * 1e6));
  EXPECT_LT(best, 1e-3);
}

TEST(ObjectTracker, LivesWithEmptyAndOddScans) {
  ObjectTracker tracker;
  EXPECT_TRUE(tracker.update(PolarScan{}).empty());
  PolarScan bare = scan_of({across(3.0, 0.0, 0.5)}, 1.0);
  for (Return& r : bare.returns) r.sigma_m = kNothing;
  EXPECT_TRUE(tracker.update(bare).empty());
  EXPECT_EQ(tracker.update(scan_of({across(3.0, 0.0, 0.5)}, 2.0)).size(), 1U);
  const auto again = tracker.update(scan_of({across(3.0, 0.0, 0.5)}, 0.5));  // Back in time.
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].hits, 1);
}

TEST(ObjectOptions, NamesTheFieldThatIsWrong) {
  ObjectOptions options;
  options.min_returns = 1;
  try {
    ObjectTracker tracker(options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "min_returns is 1; expected 2 to 100");
  }
}

}  // namespace
}  // namespace striper
