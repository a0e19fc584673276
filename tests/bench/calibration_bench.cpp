// SPDX-License-Identifier: Apache-2.0
// Times a calibration session from images to judged model, and the adjustment of its corners
// against cv::calibrateCamera on the same corners in the same run. By hand:
//   build/release/tests/bench/calibration_bench
#include <cstdio>

#include "support/opencv_rival.hpp"
#include "support/simulated_session.hpp"

namespace striper {
namespace {

constexpr int kImages = 30;
constexpr int kRuns = 5;

// The session of data/scenes/calibration.yaml with a larger image, thirty in the time of ten.
CalibrationInput session(int width, int height) {
  Scene scene = testing::calibration_scene();
  const CameraModel& camera = scene.camera;
  const double scale = static_cast<double>(width) / camera.width();
  scene.camera =
      CameraModel(width, height, scale * camera.fx(), scale * camera.fy(), 0.5 * (width - 1),
                  0.5 * (height - 1), camera.lens(), camera.distortion());
  scene.timing.picture_rate_hz = 3.0;
  return testing::simulated_session(scene, kImages);
}

void run(int width, int height, double bound_s) {
  const CalibrationInput input = session(width, height);
  const auto start = std::chrono::steady_clock::now();
  const Calibration calibration = calibrate(input, {});
  std::printf("%dx%d, %d images: %.1f s end to end on 2 threads (at most %.0f); %s\n", width,
              height, kImages, testing::seconds_since(start), bound_s,
              calibration.verdict().c_str());
  const testing::Race race = testing::race_opencv(calibration.observations, kRuns);
  std::printf(
      "  corners of %zu views: rms %.5f px in %.3f s, cv::calibrateCamera %.5f px in %.3f s, ratio "
      "%.2f (at most 2)\n",
      calibration.observations.views.size(), race.ours_px, race.ours_s, race.theirs_px,
      race.theirs_s, race.ours_s / race.theirs_s);
}

}  // namespace
}  // namespace striper

int main() {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // A line as soon as it is known, in a file too.
  striper::run(640, 480, 20.0);
  striper::run(2048, 1536, 90.0);
}
