// SPDX-License-Identifier: Apache-2.0
// Proves, on stripes whose edges are worn as the report's were (0.3 in, alike over 3 in, chunks of
// up to an inch) and exact geometry: that the filter is within a tenth of an inch at the gun where
// the report's method is within four tenths, that its sigma is true, that its innovations are
// white, that it goes on with one beam dead, through gaps, and that it does not run after what is
// not the stripe. Wear is the same for all beams, as on the road. Sweeps and their noise are not
// here: see road_run_test.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/guidance/path_filter.hpp>
#include <striper/guidance/report_path.hpp>

#include "support/allocation_counter.hpp"

namespace striper {
namespace {

constexpr double kInch = 0.0254;
constexpr double kFoot = 0.3048;
constexpr double kMph = 0.44704;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::array kBeams_m{8 * kFoot, 5 * kFoot, -8 * kFoot};

// A stripe's middle and width along the road, every half centimetre.
struct WornStripe {
  static constexpr double kStep_m = 0.005;
  std::vector<double> middle_m;
  std::vector<double> width_m;

  double at(const std::vector<double>& of, double x_m) const {
    const auto i = static_cast<std::size_t>(
        std::clamp(x_m / kStep_m, 0.0, static_cast<double>(of.size() - 1)));
    return of[i];
  }
};

WornStripe worn_stripe(double length_m, unsigned seed) {
  const auto count = static_cast<std::size_t>(length_m / WornStripe::kStep_m);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> even;
  const double alike = std::exp(-WornStripe::kStep_m / (3 * kInch));
  std::array<std::vector<double>, 2> worn;
  for (auto& edge : worn) {
    double now = 0.3 * kInch * normal(random);
    for (std::size_t i = 0; i < count; ++i) {
      now = alike * now + 0.3 * kInch * std::sqrt(1 - alike * alike) * normal(random);
      edge.push_back(now);
    }
    std::exponential_distribution<double> next(1.2);  // Chunks a metre.
    for (double x_m = next(random); x_m < length_m; x_m += next(random)) {
      const double depth_m = (0.3 + 0.7 * even(random)) * kInch;
      const double end_m = x_m + (2 + 6 * even(random)) * kInch;
      for (auto i = static_cast<std::size_t>(x_m / WornStripe::kStep_m);
           i < std::min(count, static_cast<std::size_t>(end_m / WornStripe::kStep_m)); ++i) {
        edge[i] += depth_m;
      }
    }
  }
  WornStripe stripe;
  for (std::size_t i = 0; i < count; ++i) {
    stripe.middle_m.push_back(0.5 * (worn[1][i] - worn[0][i]));
    stripe.width_m.push_back(4 * kInch - worn[0][i] - worn[1][i]);
  }
  return stripe;
}

struct Drive {
  double speed_m_s = 40 * kMph;
  double length_m = 1000.0;
  double period_m = 200 * kFoot;  // Of the wander, 3 in.
  double radius_m = 0.0;          // 0: straight. No wander on bends.
  bool is_dashed = false;
  std::array<bool, 3> is_alive{true, true, true};
  unsigned seed = 1;
};

struct Outcome {
  std::vector<double> error_in;  // Where there is paint under the gun, after the first 20 m.
  std::vector<double> pull;
  std::array<std::vector<double>, 3> innovations;
  std::vector<double> report_error_in;
  double wear_in = 0.0;
  double wear_length_in = 0.0;
  double sigma_in = 0.0;
};

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double share_within(const std::vector<double>& values, double limit) {
  return static_cast<double>(std::count_if(values.begin(), values.end(),
                                           [&](double v) { return std::abs(v) <= limit; })) /
         static_cast<double>(values.size());
}

// NaN where nothing was seen.
double mean_square(const std::vector<double>& values) {
  double sum = 0.0;
  double count = 0.0;
  for (const double value : values) {
    if (std::isnan(value)) continue;
    sum += value * value;
    count += 1.0;
  }
  return sum / count;
}

double autocorrelation(const std::vector<double>& values, std::size_t lag) {
  double products = 0.0;
  double pairs = 0.0;
  for (std::size_t i = lag; i < values.size(); ++i) {
    if (std::isnan(values[i]) || std::isnan(values[i - lag])) continue;
    products += values[i] * values[i - lag];
    pairs += 1.0;
  }
  return products / pairs / mean_square(values);
}

PathFilterOptions options() {
  PathFilterOptions options;
  options.beam_x_m.assign(kBeams_m.begin(), kBeams_m.end());
  return options;
}

bool is_painted(double x_m) { return std::fmod(x_m + 400 * kFoot, 40 * kFoot) <= 10 * kFoot; }

Outcome drive(const Drive& how) {
  const WornStripe stripe = worn_stripe(how.length_m + 10, how.seed);
  PathFilter filter(options());
  ReportPathOptions report_options;
  report_options.beam_x_m.assign(kBeams_m.begin(), kBeams_m.end());
  ReportPath report(report_options);
  std::mt19937 random(how.seed + 100);
  std::normal_distribution<double> noise(0.0, 0.03 * kInch);
  Outcome outcome;
  for (int scan = 0;; ++scan) {
    const double x_m = 3.0 + how.speed_m_s * scan / 176.0;
    if (x_m > how.length_m) break;
    const double phase = 2 * M_PI * x_m / how.period_m;
    const double offset_m = how.radius_m > 0 ? 0.0 : 3 * kInch * std::sin(phase);
    const double heading =
        how.radius_m > 0 ? 0.0 : 3 * kInch * 2 * M_PI / how.period_m * std::cos(phase);
    filter.advance(x_m);
    std::array<double, 3> seen{kNone, kNone, kNone};
    for (std::size_t b = 0; b < 3; ++b) {
      const double at_m = x_m + kBeams_m[b];
      outcome.innovations[b].push_back(kNone);
      if (!how.is_alive[b] || (how.is_dashed && !is_painted(at_m))) continue;
      const double bend_m =
          how.radius_m > 0
              ? how.radius_m - std::sqrt(how.radius_m * how.radius_m - kBeams_m[b] * kBeams_m[b])
              : 0.0;
      seen[b] = bend_m - offset_m - std::tan(heading) * kBeams_m[b] +
                stripe.at(stripe.middle_m, at_m) + noise(random);
      const SightVerdict verdict = filter.see(
          {b, seen[b], 0.03 * kInch, stripe.at(stripe.width_m, at_m) + 2 * noise(random)});
      if (verdict.is_taken) outcome.innovations[b].back() = verdict.innovation;
    }
    const double simple_m = report.update(seen).lateral_m;
    if (x_m < 23.0 || (how.is_dashed && !is_painted(x_m))) continue;
    const StripePath path = filter.path();
    const double error_m = path.lateral_m + offset_m;
    outcome.error_in.push_back(error_m / kInch);
    outcome.pull.push_back(error_m / path.sigma_lateral_m);
    outcome.report_error_in.push_back((simple_m + offset_m) / kInch);
    outcome.sigma_in = path.sigma_lateral_m / kInch;
  }
  outcome.wear_in = filter.wear_m() / kInch;
  outcome.wear_length_in = filter.wear_length_m() / kInch;
  return outcome;
}

constexpr double kWhite = 0.05;

void expect_white(const Outcome& outcome) {
  for (std::size_t b = 0; b < 3; ++b) {
    for (std::size_t lag = 1; lag <= 20; ++lag) {
      EXPECT_LE(std::abs(autocorrelation(outcome.innovations[b], lag)), kWhite)
          << "beam " << b << " lag " << lag;
    }
  }
}

void print(const char* name, const Outcome& o) {
  std::printf(
      "%s: %.3f in, %.2f %% within .5 in, pulls %.2f; report %.3f in, %.1f %%; wear %.2f in over "
      "%.1f in, sigma %.3f\n",
      name, rms(o.error_in), 100 * share_within(o.error_in, 0.5), rms(o.pull),
      rms(o.report_error_in), 100 * share_within(o.report_error_in, 0.5), o.wear_in,
      o.wear_length_in, o.sigma_in);
  for (std::size_t b = 0; b < 3; ++b) {
    double most = 0.0;
    std::size_t where = 0;
    for (std::size_t lag = 1; lag <= 20; ++lag) {
      const double now = std::abs(autocorrelation(o.innovations[b], lag));
      if (now > most) where = lag;
      most = std::max(most, now);
    }
    std::printf("   innovations of beam %zu: %.2f, autocorrelation up to %.3f (lag %zu)\n", b,
                std::sqrt(mean_square(o.innovations[b])), most, where);
  }
}

TEST(PathFilter, FollowsASolidLineOnStraightsAndBends) {
  Drive slow;
  slow.length_m = 600;
  slow.speed_m_s = 13 * kMph;
  slow.radius_m = 50 * kFoot;
  Drive wide;
  wide.length_m = 2500;
  wide.radius_m = 430 * kFoot;
  Drive straight;
  straight.length_m = 2500;
  for (const auto& [name, how] :
       {std::pair("straight, 40 mph", straight), std::pair("430 ft, 40 mph", wide),
        std::pair("50 ft, 13 mph", slow)}) {
    const Outcome o = drive(how);
    print(name, o);
    EXPECT_LE(rms(o.error_in), 0.10) << name;
    EXPECT_LE(rms(o.error_in), rms(o.report_error_in) / 3) << name;
    EXPECT_GE(share_within(o.error_in, 0.5), 0.999) << name;
    EXPECT_GE(rms(o.pull), 0.85) << name;
    EXPECT_LE(rms(o.pull), 1.15) << name;
    expect_white(o);
  }
}

TEST(PathFilter, FollowsDashesAndSwerves) {
  Drive dashes;
  dashes.length_m = 4000;
  dashes.is_dashed = true;
  Drive swerves = dashes;
  swerves.period_m = 60 * kFoot;
  Drive solid;
  solid.length_m = 2000;
  solid.period_m = 60 * kFoot;
  for (const auto& [name, how, most] :
       {std::tuple("dashes, 200 ft", dashes, 0.12), std::tuple("dashes, 60 ft", swerves, 0.25),
        std::tuple("solid, 60 ft", solid, 0.25)}) {
    const Outcome o = drive(how);
    print(name, o);
    EXPECT_LE(rms(o.error_in), most) << name;
    EXPECT_LE(rms(o.error_in), rms(o.report_error_in) / 3) << name;
    EXPECT_GE(share_within(o.error_in, 0.5), 0.98) << name;
    EXPECT_GE(rms(o.pull), 0.85) << name;
    EXPECT_LE(rms(o.pull), 1.15) << name;
  }
}

TEST(PathFilter, GoesOnWithAForwardBeamDead) {
  const double whole = rms(drive({}).error_in);
  for (const std::size_t dead : {0, 1}) {
    Drive how;
    how.is_alive[dead] = false;
    const Outcome o = drive(how);
    print("one dead", o);
    EXPECT_LE(rms(o.error_in), 2 * whole) << dead;
    EXPECT_LE(rms(o.pull), 1.2) << dead;
  }
}

TEST(PathFilter, LearnsTheWear) {
  PathFilter filter(options());
  const WornStripe stripe = worn_stripe(310, 5);
  for (double x_m = 3.0; x_m < 300; x_m += 0.05) {
    filter.advance(x_m);
    for (std::size_t b = 0; b < 3; ++b) {
      const double at_m = x_m + kBeams_m[b];
      filter.see({b, stripe.at(stripe.middle_m, at_m), 1e-4, stripe.at(stripe.width_m, at_m)});
    }
  }
  double square = 0.0;
  for (const double m : stripe.middle_m)
    square += m * m / static_cast<double>(stripe.middle_m.size());
  EXPECT_NEAR(filter.wear_m(), std::sqrt(square), 0.25 * std::sqrt(square));
  EXPECT_GT(filter.wear_length_m(), 2 * kInch);
  EXPECT_LT(filter.wear_length_m(), 6 * kInch);
}

TEST(PathFilter, GrowsItsSigmaInAGapAndForgetsBeyondItsLimit) {
  PathFilter filter(options());
  for (double x_m = 0; x_m < 20; x_m += 0.1) {
    filter.advance(x_m);
    for (std::size_t b = 0; b < 3; ++b) filter.see({b, 0.1, 1e-3, 0.1});
  }
  double before = filter.path().sigma_lateral_m;
  for (double x_m = 21; x_m < 48; x_m += 3) {
    filter.advance(x_m);
    EXPECT_GT(filter.path().sigma_lateral_m, before);
    before = filter.path().sigma_lateral_m;
    EXPECT_NEAR(filter.path().lateral_m, 0.1, 3 * before);
  }
  filter.advance(51);
  EXPECT_TRUE(std::isnan(filter.path().lateral_m));
}

TEST(PathFilter, DoesNotRunAfterOtherThings) {
  PathFilter filter(options());
  const auto go = [&](double from_m, double to_m, double lateral_m) {
    int taken = 0;
    for (double x_m = from_m; x_m < to_m; x_m += 0.1) {
      filter.advance(x_m);
      for (std::size_t b = 0; b < 3; ++b) taken += filter.see({b, lateral_m, 1e-3, 0.1}).is_taken;
    }
    return taken;
  };
  go(0, 20, 0.0);
  EXPECT_EQ(go(20, 20.7, 0.4), 0);  // A word on the road.
  EXPECT_NEAR(filter.path().lateral_m, 0.0, 0.02);
  go(20.7, 24, 0.4);  // It was the wrong line.
  EXPECT_NEAR(filter.path().lateral_m, 0.4, 0.02);
}

TEST(PathFilter, TakesAGyroscope) {
  // With one beam the stripe's curvature and the vehicle's are told apart by it alone.
  for (const bool has_gyroscope : {false, true}) {
    PathFilterOptions one;
    one.beam_x_m = {2.4};
    PathFilter filter(one);
    for (double x_m = 0; x_m < 60; x_m += 0.1) {
      filter.advance(x_m);
      filter.see({0, 0.02 * 2.4 * 2.4 / 2, 1e-3, 0.1});
      if (has_gyroscope) filter.see_curvature(0.02, 1e-4);
    }
    const StripePath path = filter.path();
    if (!has_gyroscope) continue;
    EXPECT_NEAR(path.curvature_1_m, 0.02, 0.002);
    EXPECT_NEAR(path.lateral_m, 0.0, 0.01);
  }
}

TEST(PathFilter, AllocatesNothing) {
  PathFilter filter(options());
  filter.advance(0.0);
  const testing::AllocationCounter counter;
  for (double x_m = 0; x_m < 20; x_m += 0.1) {
    filter.advance(x_m);
    for (std::size_t b = 0; b < 3; ++b) filter.see({b, 0.1, 1e-3, 0.1});
    EXPECT_FALSE(std::isnan(filter.path().lateral_m));
  }
  EXPECT_EQ(counter.count(), 0U);
}

TEST(PathFilter, RefusesWhatMakesNoSense) {
  EXPECT_THROW(PathFilter{PathFilterOptions{}}, Error);
  PathFilterOptions bad = options();
  bad.gap_limit_m = 0;
  EXPECT_THROW(PathFilter{bad}, Error);
  PathFilter filter(options());
  EXPECT_FALSE(filter.see({0, 0.1, 1e-3, 0.1}).is_taken);  // Where is it?
  filter.advance(1.0);
  EXPECT_FALSE(filter.see({7, 0.1, 1e-3, 0.1}).is_taken);
  EXPECT_FALSE(filter.see({0, kNone, 1e-3, 0.1}).is_taken);
  filter.advance(kNone);
  EXPECT_TRUE(filter.see({0, 0.1, 1e-3, kNone}).is_taken);
}

}  // namespace
}  // namespace striper
