// SPDX-License-Identifier: Apache-2.0
// Proves, against the simulator's exact truth, that the range of the method `paper` lies within its
// pixel-quantised error bar: on flat walls and in the paper's cluttered room, without noise and in
// sunlight with noise. It does not prove that the error bar is as small as it could be.
#include <algorithm>
#include <iostream>

#include <gtest/gtest.h>

#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/radiometry.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/shared_data.hpp"

namespace striper {
namespace {

struct Containment {
  int returns = 0;  // Away from depth edges.
  int inside = 0;   // The true range is within [range_near_m, range_far_m].
  int weak = 0;     // Truth below the stated peak over noise: not counted above.

  double fraction() const { return static_cast<double>(inside) / returns; }

  friend std::ostream& operator<<(std::ostream& out, const Containment& c) {
    return out << c.inside << " of " << c.returns << " returns within their error bar";
  }
};

constexpr double kLeastPeakOverNoise = 10.0;

// Peak of a return over the noise at the peak, shot and read noise and quantisation together.
double peak_over_noise(const NoiseModel& noise, double background_dn, double amplitude_dn) {
  return amplitude_dn / std::sqrt(noise.variance_dn2(background_dn + amplitude_dn));
}

Containment measure(const Scene& scene, int frames) {
  Simulator simulator(scene);
  const StriperModel model = simulator.model();
  ScannerOptions options = ScannerOptions::for_model(model);
  options.stripe.method = ExtractMethod::kPaper;
  options.ambient.pattern =
      scene.timing.pattern;  // Given, so that no frame waits for the next one.
  Scanner scanner(model, options);
  Containment result;
  for (int n = 0; n < frames; ++n) {
    const auto number = static_cast<std::uint64_t>(n);
    const std::vector<Truth> truth = simulator.truth(number);
    const cv::Mat background = simulator.expected_dn(number);
    for (const PolarScan& scan : scanner.process(simulator.render(number))) {
      for (std::size_t i = 0; i < scan.returns.size(); ++i) {
        const Return& r = scan.returns[i];
        const TrueLine& line = truth.at(0).lines[i];
        const bool countable = line.status == TruthStatus::kVisible && !line.brightest.near_edge &&
                               !line.brightest.blind && line.others.empty();
        if (r.status != ReturnStatus::kOk || !countable) continue;
        const double row = std::clamp(line.brightest.v_px - 12.0, 0.0, background.rows - 1.0);
        const double background_dn =
            background.at<float>(static_cast<int>(row), static_cast<int>(i));
        if (model.noise && peak_over_noise(*model.noise, background_dn,
                                           line.brightest.amplitude_dn) < kLeastPeakOverNoise) {
          ++result.weak;
          continue;
        }
        ++result.returns;
        const double truth_m = line.brightest.range_m;
        if (truth_m >= r.range_near_m && truth_m <= r.range_far_m) ++result.inside;
      }
    }
  }
  std::cout << scene.name << ": " << result << "\n";
  return result;
}

void switch_noise_off(Scene& scene) {
  scene.imager.noise.shot = false;
  scene.imager.noise.read_noise_e = 0.0;
  scene.imager.noise.prnu = 0.0;
  scene.imager.noise.speckle = 0.0;
}

// A sun behind the striper, as bright as the paper's: a stripe-to-sun ratio of 6.5 at 2 m.
void shine(Scene& scene) {
  scene.daylight.sun_w_m2_nm = 1.0;
  scene.daylight.sun_w_m2_nm = stripe_to_sun_ratio(scene, 0, 2.0) / 6.5;
  scene.daylight.sun_direction = Eigen::Vector3d(-1.0, 0.0, 0.0);
  scene.daylight.shadows = false;
}

Scene room() { return load_scene(testing::source_path("data/scenes/room.yaml")); }

TEST(PaperMethodOnWalls, TruthIsWithinTheErrorBarWithoutNoise) {
  int returns = 0;
  for (const double distance_m : {1.4, 1.77, 2.0, 2.31, 3.0}) {
    Scene scene = Scene::flat_wall(distance_m);
    scene.imager.blur_sigma_px = 0.5;
    switch_noise_off(scene);
    const Containment result = measure(scene, 1);
    EXPECT_GE(result.fraction(), 0.99) << "at " << distance_m << " m";
    returns += result.returns;
  }
  EXPECT_GT(returns, 2000);
}

TEST(PaperMethodOnWalls, TruthIsWithinTheErrorBarInSunlight) {
  int returns = 0;
  for (const double distance_m : {1.6, 2.0, 2.4}) {
    for (const double width_px : {0.6, 0.9}) {
      Scene scene = Scene::flat_wall(distance_m);
      shine(scene);
      const double focal_px = scene.camera.fx();
      for (SimulatedLaser& laser : scene.lasers) {
        // The same light in a stripe of the stated width in the image.
        laser.divergence_sigma_rad = width_px / focal_px;
        laser.pulse_energy_j *= laser.divergence_sigma_rad / SimulatedLaser().divergence_sigma_rad;
      }
      const Containment result = measure(scene, 5);
      EXPECT_GE(result.fraction(), 0.95) << "at " << distance_m << " m, " << width_px << " px";
      EXPECT_GT(result.returns, 100) << "at " << distance_m << " m, " << width_px << " px";
      returns += result.returns;
    }
  }
  EXPECT_GT(returns, 10'000);
}

TEST(PaperMethodInTheRoom, TruthIsWithinTheErrorBarWithoutNoise) {
  Scene scene = room();
  switch_noise_off(scene);
  const Containment result = measure(scene, 1);
  EXPECT_GE(result.fraction(), 0.99);
  EXPECT_GT(result.returns, 250);
}

TEST(PaperMethodInTheRoom, TruthIsWithinTheErrorBarWithNoise) {
  const Containment result = measure(room(), 20);
  EXPECT_GE(result.fraction(), 0.95);
  EXPECT_GT(result.returns, 2000);
}

TEST(PaperMethodInTheRoom, TruthIsWithinTheErrorBarInSunlight) {
  Scene scene = room();
  shine(scene);
  const Containment result = measure(scene, 20);
  EXPECT_GE(result.fraction(), 0.95);
  EXPECT_GT(result.returns, 2000);
}

}  // namespace
}  // namespace striper
