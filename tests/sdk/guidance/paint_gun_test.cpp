// SPDX-License-Identifier: Apache-2.0
// Proves, with a valve that delays and a beam 8 ft ahead of the gun, that paint lies on the dashes
// that the beam saw, at any speed, with several dashes in flight, and on nothing else. Does not
// prove how well the ends are seen.
#include <deque>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/guidance/paint_gun.hpp>

namespace striper {
namespace {

using Dashes = std::vector<std::pair<double, double>>;
constexpr double kBeam_m = 8 * 0.3048;
constexpr double kStep_s = 1e-4;
constexpr double kMile_h = 0.44704;

// The beam's report of what it passes between two places.
void look(PaintGun& gun, const Dashes& dashes, double before_m, double now_m) {
  for (const auto& [from_m, to_m] : dashes) {
    if (from_m > before_m && from_m <= now_m) gun.begin_dash(from_m);
    if (now_m > from_m && now_m < to_m) gun.see_paint(now_m);
    if (to_m > before_m && to_m <= now_m) gun.end_dash(to_m);
  }
}

// Drives over the dashes. @return where the valve, slower than its signal, has put paint.
Dashes drive(const PaintGunOptions& options, const Dashes& dashes, double speed_m_s) {
  PaintGun gun(options);
  std::deque<std::pair<double, bool>> valve;  // When, what.
  Dashes painted;
  bool was_on = false;
  for (double time_s = 0.0; time_s * speed_m_s < dashes.back().second + 5.0; time_s += kStep_s) {
    const double at_m = time_s * speed_m_s;
    look(gun, dashes, at_m + kBeam_m - kStep_s * speed_m_s, at_m + kBeam_m);
    const bool is_on = gun.update(at_m, speed_m_s);
    const double delay_s = is_on ? options.on_delay_s : options.off_delay_s;
    if (is_on != std::exchange(was_on, is_on)) valve.emplace_back(time_s + delay_s, is_on);
    for (; !valve.empty() && valve.front().first <= time_s; valve.pop_front()) {
      const double gun_m = at_m + options.x_m;
      if (valve.front().second) painted.emplace_back(gun_m, gun_m);
      if (!valve.front().second) painted.back().second = gun_m;
    }
  }
  return painted;
}

void expect_painted(const Dashes& painted, const Dashes& expected, double within_m) {
  ASSERT_EQ(painted.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(painted[i].first, expected[i].first, within_m) << i;
    EXPECT_NEAR(painted[i].second, expected[i].second, within_m) << i;
  }
}

PaintGunOptions slow_valve() {
  PaintGunOptions options;
  options.on_delay_s = 0.040;
  options.off_delay_s = 0.025;
  return options;
}

TEST(PaintGun, PaintsDashesWhereTheyAreAtAnySpeed) {
  const Dashes dashes = {{5.0, 8.0}, {17.0, 20.0}, {29.0, 32.0}};
  for (const double mph : {3.0, 20.0, 40.0, 58.15}) {
    SCOPED_TRACE(mph);
    const double speed_m_s = mph * kMile_h;
    expect_painted(drive(slow_valve(), dashes, speed_m_s), dashes, 3 * kStep_s * speed_m_s);
  }
}

TEST(PaintGun, HoldsSeveralDashesInFlight) {
  const Dashes dots = {{5.0, 5.3}, {5.9, 6.2}, {6.8, 7.1}, {7.7, 8.0}, {8.6, 8.9}};
  PaintGun gun(slow_valve());
  look(gun, dots, 4.0, 4.5);
  for (double at_m = 4.5; at_m < 9.0; at_m += 0.01) look(gun, dots, at_m - 0.01, at_m);
  EXPECT_EQ(gun.waiting(), 5U);
  expect_painted(drive(slow_valve(), dots, 5.0), dots, 0.002);
}

TEST(PaintGun, ExtendsEndsAndAdvancesApart) {
  PaintGunOptions options = slow_valve();
  options.end_extension_m = 0.0508;
  expect_painted(drive(options, {{5.0, 8.0}}, 10.0), {{4.9492, 8.0508}}, 0.003);
  options.end_extension_m = 0.0;
  options.on_advance_m = 0.1;
  options.off_advance_m = 0.3;
  expect_painted(drive(options, {{5.0, 8.0}}, 10.0), {{4.9, 7.7}}, 0.003);
}

TEST(PaintGun, IsWhereItsOffsetSays) {
  PaintGunOptions options = slow_valve();
  options.x_m = -0.7;
  expect_painted(drive(options, {{5.0, 8.0}}, 10.0), {{5.0, 8.0}}, 0.003);
}

TEST(PaintGun, LeavesOutShortDashesAndPaintsOverShortGaps) {
  PaintGunOptions options = slow_valve();
  options.dash_min_m = 0.5;
  options.gap_min_m = 0.3;
  const Dashes seen = {{5.0, 5.4}, {9.0, 10.0}, {10.2, 11.0}, {15.0, 18.0}};
  expect_painted(drive(options, seen, 10.0), {{9.0, 11.0}, {15.0, 18.0}}, 0.003);
}

TEST(PaintGun, PaintsNoFurtherThanItHasSeen) {
  PaintGun gun{PaintGunOptions{}};
  gun.begin_dash(5.0);
  EXPECT_FALSE(gun.update(5.1, 1.0));  // A beginning alone is no paint.
  gun.see_paint(6.0);
  EXPECT_TRUE(gun.update(5.5, 1.0));
  EXPECT_FALSE(gun.update(6.01, 1.0));
  gun.see_paint(7.0);
  EXPECT_TRUE(gun.update(6.5, 1.0));
}

TEST(PaintGun, ATruckThatRollsBackPaintsNoFurtherThanTheDash) {
  PaintGun gun{PaintGunOptions{}};
  gun.begin_dash(5.0);
  gun.see_paint(9.0);
  EXPECT_TRUE(gun.update(5.5, 1.0));
  EXPECT_TRUE(gun.update(4.98, 1.0));  // Noise of the odometer.
  EXPECT_FALSE(gun.update(4.9, 1.0));
  EXPECT_FALSE(gun.update(3.0, 1.0));
  EXPECT_TRUE(gun.update(5.1, 1.0));
}

TEST(PaintGun, ClosesOnStopAndOnUnknownMotion) {
  PaintGun gun{PaintGunOptions{}};
  gun.begin_dash(5.0);
  gun.see_paint(9.0);
  EXPECT_TRUE(gun.update(5.5, 1.0));
  EXPECT_FALSE(gun.update(std::numeric_limits<double>::quiet_NaN(), 1.0));
  EXPECT_TRUE(gun.update(5.6, 1.0));
  gun.stop();
  EXPECT_FALSE(gun.update(5.7, 1.0));
  EXPECT_EQ(gun.waiting(), 0U);
}

TEST(PaintGun, CountsDashesThatFindTheQueueFull) {
  PaintGunOptions options;
  options.dashes = 2;
  PaintGun gun(options);
  EXPECT_TRUE(gun.begin_dash(1.0));
  EXPECT_TRUE(gun.begin_dash(2.0));
  EXPECT_FALSE(gun.begin_dash(3.0));
  EXPECT_EQ(gun.lost(), 1U);
  gun.see_paint(3.5);  // Of the lost one: the gap before it stays bare.
  EXPECT_FALSE(gun.update(2.5, 1.0));
}

TEST(PaintGun, RefusesOptionsThatMeanNothing) {
  PaintGunOptions options;
  options.on_delay_s = -0.01;
  EXPECT_THROW(PaintGun{options}, Error);
  options = {};
  options.dashes = 0;
  EXPECT_THROW(PaintGun{options}, Error);
}

}  // namespace
}  // namespace striper
