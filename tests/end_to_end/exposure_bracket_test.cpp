// SPDX-License-Identifier: Apache-2.0
// Proves that an exposure bracket sees black and white, near and far, in one scan with true error
// bars, where each of its exposures alone does not; that its laser's time counts; and that a
// recording and a lost frame are put together alike. Simulated, against exact truth.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/error_of.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

constexpr double kMatchPx = 3.0;
constexpr int kRounds = 24;

// What the scans of one surface are worth.
struct Surface {
  std::string name;
  double nearest_m, farthest_m;
  bool is_left;  // Of the middle of its panels.
  std::size_t columns = 0;
  std::size_t found = 0;
  std::size_t wrong = 0;
  std::vector<double> pulls = {};

  double found_part() const {
    return static_cast<double>(found) / static_cast<double>(std::max<std::size_t>(1, columns));
  }
  // Robust: of a normal distribution its standard deviation.
  double pull() const {
    if (pulls.empty()) return std::nan("");
    std::vector<double> sizes = pulls;
    for (double& pull : sizes) pull = std::abs(pull);
    return robust_sigma(sizes);
  }
};

// The four panels of data/scenes/bracket.yaml. The near ones are right of the middle.
std::vector<Surface> panels() {
  return {{"0.5 m, 90 %", 0.4, 1.0, false},
          {"0.5 m, 3 %", 0.4, 1.0, true},
          {"4 m, 3 %", 3.5, 6.0, false},
          {"4 m, 90 %", 3.5, 6.0, true}};
}

bool is_on(const Surface& surface, const TrueReturn& truth) {
  if (truth.range_m < surface.nearest_m || truth.range_m > surface.farthest_m) return false;
  // Where the panels meet: y = -0.13 at .5 m, 1.2 at 4 m.
  const double edge_m = surface.farthest_m < 2.0 ? -0.13 : 1.2;
  return (truth.y_m > edge_m) == surface.is_left;
}

Scene scene_with(const std::string& pattern) {
  Scene scene = load_scene(testing::source_path("data/scenes/bracket.yaml"));
  if (!pattern.empty()) scene.timing.pattern = IlluminationPattern::parse(pattern);
  return scene;
}

void judge(const PolarScan& scan, const Truth& truth, std::vector<Surface>& surfaces) {
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    const TrueReturn& t = truth.lines[i].brightest;
    if (truth.lines[i].status != TruthStatus::kVisible || t.near_edge) continue;
    for (Surface& surface : surfaces) {
      if (!is_on(surface, t)) continue;
      ++surface.columns;
      const Return& r = scan.returns[i];
      if (r.status != ReturnStatus::kOk) continue;
      if (!(std::abs(r.v_px - t.v_px) < kMatchPx)) {
        ++surface.wrong;
        continue;
      }
      ++surface.found;
      surface.pulls.push_back((r.range_m - t.range_m) / r.sigma_m);
    }
  }
}

// @param pattern empty: the scene's.
std::vector<Surface> scan_panels(const std::string& pattern) {
  Simulator simulator(scene_with(pattern));
  ScannerOptions options;
  options.ambient.pattern = simulator.scene().timing.pattern;
  Scanner scanner(simulator.model(), options);
  std::vector<Surface> surfaces = panels();
  const Truth truth = simulator.truth(0).front();
  const auto frames = kRounds * options.ambient.pattern.entries().size();
  for (std::uint64_t n = 0; n < frames; ++n) {
    for (const PolarScan& scan : scanner.process(simulator.render(n))) {
      judge(scan, truth, surfaces);
    }
  }
  for (const Surface& s : surfaces) {
    std::cout << (pattern.empty() ? simulator.scene().timing.pattern.to_string() : pattern) << ": "
              << s.name << ": found " << 100.0 * s.found_part() << " % of " << s.columns
              << ", wrong " << s.wrong << ", pull " << s.pull() << "\n";
  }
  return surfaces;
}

TEST(ExposureBracket, SeesBlackAndWhiteNearAndFar) {
  for (const Surface& surface : scan_panels("")) {
    SCOPED_TRACE(surface.name);
    EXPECT_GT(surface.columns, 2000U);
    EXPECT_GE(surface.found_part(), 0.99);
    EXPECT_EQ(surface.wrong, 0U);
    EXPECT_GE(surface.pull(), 0.95);
    EXPECT_LE(surface.pull(), 1.05);
  }
}

bool is_right(const Surface& surface) {
  return surface.found_part() >= 0.99 && surface.pull() >= 0.95 && surface.pull() <= 1.05;
}

// The reason for the bracket: no single exposure sees all four with true error bars.
TEST(ExposureBracket, NoExposureOfItDoesAlone) {
  for (const char* pattern : {"0@8,dark@8", "0@240,dark@240", "0@7200,dark@7200"}) {
    const std::vector<Surface> surfaces = scan_panels(pattern);
    EXPECT_FALSE(std::all_of(surfaces.begin(), surfaces.end(), is_right)) << pattern;
  }
}

struct Rounds {
  std::vector<std::uint64_t> sequences;  // Of the scans.
  double lit_s = 0.0;
};

Rounds scan_rounds(std::uint64_t frames, const std::set<std::uint64_t>& lost) {
  Simulator simulator(scene_with(""));
  ScannerOptions options;
  options.ambient.pattern = simulator.scene().timing.pattern;
  Scanner scanner(simulator.model(), options);
  Rounds rounds;
  const auto take = [&](const auto& scans) {
    for (const PolarScan& scan : scans) rounds.sequences.push_back(scan.sequence);
  };
  for (std::uint64_t n = 0; n < frames; ++n) {
    if (lost.count(n) == 0) take(scanner.process(simulator.render(n)));
  }
  take(scanner.finish());
  rounds.lit_s = scanner.statistics().lit_s;
  return rounds;
}

TEST(ExposureBracket, GivesAScanForEachRoundOfThePattern) {
  // The middle exposure of the second round is lost.
  const Rounds rounds = scan_rounds(18, {8, 9});
  EXPECT_THAT(rounds.sequences, ::testing::ElementsAre(0, 6, 12));
  // 8, 240 and 7200 us a round, and the second without its 240.
  EXPECT_NEAR(rounds.lit_s, 3 * 7448e-6 - 240e-6, 1e-9);
}

TEST(ExposureBracket, ALastExposureThatIsLostIsNotWaitedFor) {
  EXPECT_THAT(scan_rounds(12, {4, 5}).sequences, ::testing::ElementsAre(0, 6));
}

TEST(ExposureBracket, RefusesAllPeaks) {
  ScannerOptions options;
  options.ambient.pattern = IlluminationPattern::parse("0@20,0@200");
  options.stripe.peak = PeakRule::kAll;
  const Error error = testing::error_of([&] { Scanner scanner(options); });
  EXPECT_THAT(error.what(), ::testing::HasSubstr("laser=0@20,0@200"));
}

}  // namespace
}  // namespace striper
