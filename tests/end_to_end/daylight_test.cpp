// SPDX-License-Identifier: Apache-2.0
// Proves, against the simulator's exact truth, that the stripe is found in sunlight where the
// paper's method fails: in the two fields of its NTSC camera, beside brighter surfaces and lamps,
// moving, with several lasers. With STRIPER_FULL_TRIALS there are as many pictures as decide the
// goals. It does not prove what real asphalt or a real lens does.
#include "support/daylight.hpp"

#include <array>
#include <cmath>
#include <iostream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/simulator/scene_yaml.hpp>

#include "support/shared_data.hpp"

namespace striper {
namespace {

using testing::DaylightScore;
using testing::DaylightWay;
using ::testing::HasSubstr;
using ::testing::Not;

#ifdef STRIPER_FULL_TRIALS
constexpr int kPictures = 121;
constexpr int kMovingPictures = 41;
#else
constexpr int kPictures = 7;
#endif

const DaylightWay kPaper{ExtractMethod::kPaper, PeakRule::kBrightest, AmbientMethod::kNone};

// Three standard errors of so many columns more: what chance alone may do.
double with_chance(double rate, std::size_t columns) {
  const auto n = static_cast<double>(std::max<std::size_t>(1, columns));
  return rate + 3.0 * std::sqrt(rate * (1.0 - rate) / n);
}

Scene hard_case() { return load_scene(testing::source_path("data/scenes/ntsc_sun.yaml")); }

DaylightScore scan(const Scene& scene, const DaylightWay& way, int pictures,
                   std::string* decisions = nullptr) {
  const DaylightScore score = testing::scan_in_daylight(
      scene, way, pictures, [](int) { return true; }, decisions);
  std::cout << scene.name << ": found " << score.found << " of " << score.countable << ", "
            << score.false_points << " false points in " << score.columns
            << " columns, range error " << score.error_mm() << " mm, pull " << score.pull() << "\n";
  return score;
}

TEST(HardCase, FieldsWithTheTrackerFindTheStripe) {
  std::string decisions;
  const DaylightScore score = scan(hard_case(), {}, kPictures, &decisions);
  EXPECT_THAT(decisions, HasSubstr("cadence 0,dark (found)"));
  EXPECT_THAT(decisions, HasSubstr("ambient fields"));
  EXPECT_EQ(score.scans, static_cast<std::size_t>(kPictures - 1));
  EXPECT_EQ(score.scans_of_dark, 0U);
  EXPECT_GE(score.found_fraction(), 0.99);
  EXPECT_LE(score.false_per_column(), with_chance(5e-4, score.columns));
  EXPECT_NEAR(score.pull(), 1.0, 0.1);
}

TEST(HardCase, MethodPaperFails) {
  const DaylightScore score = scan(hard_case(), kPaper, 4);
  EXPECT_LT(score.found_fraction(), 0.5);
}

// Three lasers at 0.4, 0.5 and 0.6 m below the camera light a wall in turn.
TEST(SeveralLasers, GiveOneScanEachAndDarkNone) {
  Scene scene = Scene::flat_wall(2.0);
  scene.daylight.sun_w_m2_nm = 0.4;
  scene.daylight.sun_direction = Eigen::Vector3d(-1.0, 0.0, 0.2);
  scene.lasers.assign(3, SimulatedLaser{});
  for (std::size_t n = 0; n < 3; ++n) {
    scene.lasers[n].T_device_laser.translation().z() = -0.4 - 0.1 * static_cast<double>(n);
  }
  scene.timing.cadence = Cadence::parse("0,1,2,dark");
  Simulator simulator(scene);
  Scanner scanner(simulator.model());
  std::array<int, 3> scans{};
  const auto check = [&](std::span<const PolarScan> ready) {
    for (const PolarScan& scan : ready) {
      ++scans.at(static_cast<std::size_t>(scan.laser));
      DaylightScore score;
      testing::add_scan(scan, simulator, score);
      EXPECT_EQ(scan.laser, simulator.truth(scan.sequence).at(0).laser);
      EXPECT_GE(score.found_fraction(), 0.99) << scan.sequence;
      EXPECT_LT(score.error_mm(), 20.0) << scan.sequence;
    }
  };
  for (std::uint64_t picture = 0; picture < 13; ++picture) {
    Frame frame = simulator.render(picture);
    frame.illumination = Illumination::unknown();
    check(scanner.process(frame));
  }
  check(scanner.finish());
  EXPECT_EQ(scans, (std::array<int, 3>{4, 3, 3}));
}

#ifdef STRIPER_FULL_TRIALS

// What moves takes a second a picture to render.

TEST(HardCase, WhatPassesByMakesNoGhosts) {
  Scene scene = hard_case();
  testing::drive(scene, 10.0);
  const DaylightScore score = scan(scene, {}, kMovingPictures);
  EXPECT_EQ(score.scans_of_dark, 0U);
  EXPECT_GE(score.found_fraction(), 0.95);
  EXPECT_LE(score.false_per_column(), with_chance(1e-3, score.columns));
}

TEST(HardCase, CadenceIsFoundAtAHundredKilometresPerHour) {
  Scene scene = hard_case();
  testing::drive(scene, 27.8);
  std::string decisions;
  const DaylightScore score = scan(scene, {}, 7, &decisions);
  EXPECT_THAT(decisions, HasSubstr("cadence 0,dark (found)"));
  EXPECT_EQ(score.scans_of_dark, 0U);
}

TEST(FieldOrder, WrongOneIsReported) {
  for (const bool is_wrong : {false, true}) {
    Scene scene = hard_case();
    testing::drive(scene, 5.0);
    Simulator simulator(scene);
    Scanner scanner(simulator.model());
    for (std::uint64_t picture = 0; picture < 6; ++picture) {
      Frame frame = simulator.render(picture);
      frame.illumination = Illumination::unknown();
      if (is_wrong) frame.field = Field::kInterlacedTopFirst;
      scanner.process(frame);
    }
    const auto complaint = HasSubstr("the fields seem to be in the wrong order");
    if (is_wrong) {
      EXPECT_THAT(scanner.decisions(), complaint);
    } else {
      EXPECT_THAT(scanner.decisions(), Not(complaint));
    }
  }
}

#endif

}  // namespace
}  // namespace striper
