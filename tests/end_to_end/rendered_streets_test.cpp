// SPDX-License-Identifier: Apache-2.0
// Proves, on rendered frames of the streets in data/scenes/street, that curbs are found along the
// way, where and as high as they are, on wet asphalt, in the sun, in rain, behind a dirty window
// and behind somebody who walks by; and that what is none is not called one. Every draw has its own
// noise and place. How often what is missed or false: tests/sdk/detect, on exact geometry.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <striper/detect/curb_detector.hpp>
#include <striper/detect/objects.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/profile_scans.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

#ifdef STRIPER_FULL_TRIALS
constexpr int kDraws = 20;
constexpr int kScans = 20;  // 5 m.
#else
constexpr int kDraws = 1;
constexpr int kScans = 10;
#endif
constexpr double kSpeed_m_s = 5.0;
constexpr double kUp_rad = (90.0 + 28.0) * std::numbers::pi / 180.0;

struct CurbTruth {
  CurbKind kind;
  double foot_m;
  double height_m;
};

Scene street(const std::string& name, int draw) {
  Scene scene = load_scene(testing::source_path("data/scenes/street/" + name + ".yaml"));
  scene.seed = 1000U + static_cast<std::uint64_t>(draw);
  return scene;
}

/// Renders and scans frames of a scene, one after the other.
class SceneScans {
 public:
  explicit SceneScans(const Scene& scene)
      : simulator_(scene), scanner_(simulator_.model(), options(scene, simulator_.model())) {}

  template <typename Take>
  void each(int frames, const Take& take) {
    for (int k = 0; k < frames; ++k) {
      for (const PolarScan& scan :
           scanner_.process(simulator_.render(static_cast<std::uint64_t>(k))))
        take(scan);
    }
  }

 private:
  static ScannerOptions options(const Scene& scene, const StriperModel& model) {
    ScannerOptions options = ScannerOptions::for_model(model);
    options.ambient.pattern = scene.timing.pattern;
    return options;
  }

  Simulator simulator_;
  Scanner scanner_;
};

Motion motion_at(const PolarScan& scan) {
  Motion motion;
  motion.time_s = scan.time.seconds();
  motion.distance_m = kSpeed_m_s * motion.time_s;
  return motion;
}

/// The most probable curb after all scans; without confidence where there is none.
CurbTrack curb_of(const Scene& scene) {
  CurbDetectorOptions options;
  options.curb.up_rad = kUp_rad;
  CurbDetector detector(options);
  CurbTrack best;
  SceneScans(scene).each(kScans, [&](const PolarScan& scan) {
    best = {};
    for (const CurbTrack& track : detector.update(scan, motion_at(scan)))
      if (track.confidence > best.confidence) best = track;
  });
  return best;
}

// A tenth of what a wheel or a foot takes note of.
constexpr double kPlace_m = 0.01;
constexpr double kHeight_m = 0.005;

class StreetWithACurb : public ::testing::TestWithParam<std::pair<const char*, CurbTruth>> {};

TEST_P(StreetWithACurb, IsFoundWhereItIs) {
  const auto& [name, truth] = GetParam();
  testing::Rms place, height;
  int found = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Scene scene = street(name, draw);
    const double shift = testing::uniform(-0.01, 0.01);
    scene.T_world_device.translation().x() += shift;
    const CurbTrack track = curb_of(scene);
    if (track.confidence < 0.5 || track.kind != truth.kind) continue;
    ++found;
    place.add(track.lateral_m - (truth.foot_m - shift));
    height.add(track.height_m - truth.height_m);
  }
  ASSERT_GT(found, 0) << name;
  std::cout << fmt::format("{}: {} of {} found, place {:.1f} mm, height {:.1f} mm rms\n", name,
                           found, kDraws, 1e3 * place.value(), 1e3 * height.value());
  EXPECT_EQ(found, kDraws);
  EXPECT_LE(place.value(), kPlace_m);
  EXPECT_LE(height.value(), kHeight_m);
}

INSTANTIATE_TEST_SUITE_P(
    Streets, StreetWithACurb,
    ::testing::Values(std::pair("up", CurbTruth{CurbKind::kUp, 1.2, 0.15}),
                      std::pair("low", CurbTruth{CurbKind::kUp, 1.3, 0.05}),
                      std::pair("battered", CurbTruth{CurbKind::kUp, 1.2, 0.12}),
                      // Along the gutter, which is the road's last straight piece.
                      std::pair("gutter", CurbTruth{CurbKind::kUp, 1.3513, 0.15}),
                      std::pair("down", CurbTruth{CurbKind::kDown, 1.2, 0.12}),
                      std::pair("wet", CurbTruth{CurbKind::kUp, 1.2, 0.12}),
                      std::pair("sun", CurbTruth{CurbKind::kUp, 1.2, 0.12}),
                      std::pair("rain", CurbTruth{CurbKind::kUp, 1.2, 0.12}),
                      std::pair("spray", CurbTruth{CurbKind::kUp, 1.2, 0.12}),
                      std::pair("window", CurbTruth{CurbKind::kUp, 1.2, 0.12}),
                      std::pair("walker_on_road", CurbTruth{CurbKind::kUp, 1.3, 0.12}),
                      std::pair("walker_behind_curb", CurbTruth{CurbKind::kUp, 1.3, 0.12})),
    [](const auto& street) { return street.param.first; });

class StreetWithoutACurb : public ::testing::TestWithParam<const char*> {};

TEST_P(StreetWithoutACurb, HasNone) {
  const char* const name = GetParam();
  int called = 0;
  double most = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Scene scene = street(name, draw);
    scene.T_world_device.translation().x() += testing::uniform(-0.01, 0.01);
    const CurbTrack track = curb_of(scene);
    called += track.confidence > 0.5 ? 1 : 0;
    most = std::max(most, track.confidence);
  }
  std::cout << fmt::format("{}: {} of {} called a curb, with {:.2f} at most\n", name, called,
                           kDraws, most);
  EXPECT_EQ(called, 0);
}

INSTANTIATE_TEST_SUITE_P(Streets, StreetWithoutACurb,
                         ::testing::Values("gutter_flush", "box", "wheel", "wall", "grass_flush",
                                           "ramp", "pothole"),
                         [](const auto& street) { return std::string(street.param); });

// Somebody on the pavement is behind the curb. (Who walks on the road hides this striper's curb
// from the first scan on: then nothing says on which side he is.)
TEST(StreetWithAWalker, ZonesAreTrue) {
  int seen = 0, right = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    CurbDetectorOptions options;
    options.curb.up_rad = kUp_rad;
    CurbDetector curbs(options);
    ObjectTracker tracker;
    SceneScans(street("walker_behind_curb", draw)).each(20, [&](const PolarScan& scan) {
      curbs.update(scan);
      tracker.set_street(curbs);
      for (const ObjectTrack& track : tracker.update(scan)) {
        if (!track.is_seen) continue;
        ++seen;
        right += track.zone == ObjectZone::kBehindCurb ? 1 : 0;
      }
    });
  }
  std::cout << fmt::format("{} of {} zones are behind the curb\n", right, seen);
  EXPECT_GE(seen, 5 * kDraws);
  EXPECT_GE(right, seen * 99 / 100);
}

}  // namespace
}  // namespace striper
