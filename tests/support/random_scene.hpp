// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>

#include <striper/model/striper_model.hpp>
#include <striper/simulator/scene.hpp>

namespace striper::testing {

// Scenes with exact truth in which something else than the stripe is often the brightest, narrowest
// or straightest thing. Each is a function of its seed alone. Seeds 10000 to 19999 are held out:
// nothing may be tuned on them. The others are for development.

/// A source of numbers of its own, so that one scene never depends on what was drawn before it.
class SceneDice {
 public:
  explicit SceneDice(std::uint64_t seed) : generator_(seed * 0x9E3779B97F4A7C15ULL + 17) {}

  /// Uniform in [low, high), the same numbers with every standard library.
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11U) * 0x1.0p-53;
  }
  /// The same with equal shares for equal ratios; 0 < low.
  double ratio(double low, double high);
  /// Whole numbers from low to high, both included.
  int whole(int low, int high);
  bool chance(double probability) { return between(0.0, 1.0) < probability; }

 private:
  std::mt19937_64 generator_;
};

/// A furnished room with textures, light sources, black and shiny things before a striper of random
/// optics; the laser is always on. Nothing moves: images differ by their noise.
Scene random_room(std::uint64_t seed);

/// The same room with bare surfaces, no light sources and a weak laser: what only noise moves.
Scene random_bare_room(std::uint64_t seed);

/// A calibration session as data/scenes/calibration.yaml: a board of one of four kinds is turned
/// and carried through the laser plane, kSessionFrames frames.
Scene random_session(std::uint64_t seed);
inline constexpr int kSessionFrames = 10;

/// The same scene with the laser switched off: every exposure is dark.
Scene without_laser(Scene scene);

/// The same scene up to four times as bright in the image, by its seed: stripes clip, white paper
/// may.
Scene overexposed(Scene scene);

/// What a calibration would store of the stripe's look: width and brightness on white paper over
/// range, in closed form, and the range that was calibrated.
StripeLook look_of(const Scene& scene);

/// Amplitude of the stripe on a diffuse surface that faces the laser squarely, DN; the laser's
/// Gaussian and the lens blur together.
double stripe_amplitude_dn(const Scene& scene, double reflectance, double range_m);

}  // namespace striper::testing
