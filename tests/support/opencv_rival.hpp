// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

#include <opencv2/calib3d.hpp>

#include <striper/adjust/solve_joint.hpp>

namespace striper::testing {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Corners as cv::calibrateCamera wants them.
struct OpenCvCorners {
  std::vector<std::vector<cv::Point3f>> object;
  std::vector<std::vector<cv::Point2f>> image;

  explicit OpenCvCorners(const Observations& observations) {
    for (const CornerView& view : observations.views) {
      auto& points = object.emplace_back();
      auto& pixels = image.emplace_back();
      for (std::size_t i = 0; i < view.pixel.size(); ++i) {
        const Eigen::Vector2d p = observations.board.point_m(view.point[i]);
        points.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
        pixels.emplace_back(static_cast<float>(view.pixel[i].x()),
                            static_cast<float>(view.pixel[i].y()));
      }
    }
  }
};

/// How well two programs fit the same corners, all of them, with the same five-coefficient lens,
/// and the shortest time that each took.
struct Race {
  double ours_px = 0.0;
  double theirs_px = 0.0;
  double ours_s = 1e9;
  double theirs_s = 1e9;
};

/// The adjustment against cv::calibrateCamera, in turns; the stripes are left out.
inline Race race_opencv(Observations observations, int runs) {
  observations.stripes.clear();
  const OpenCvCorners corners(observations);
  const cv::Size size(observations.image_width, observations.image_height);
  JointOptions options;
  options.remove_outliers = false;
  options.threads = 2;
  Race race;
  for (int run = 0; run < runs; ++run) {
    auto start = std::chrono::steady_clock::now();
    race.ours_px = solve_joint(observations, options).corners.rms_px;
    race.ours_s = std::min(race.ours_s, seconds_since(start));
    cv::Mat K;
    cv::Mat D;
    std::vector<cv::Mat> rotations;
    std::vector<cv::Mat> translations;
    start = std::chrono::steady_clock::now();
    race.theirs_px =
        cv::calibrateCamera(corners.object, corners.image, size, K, D, rotations, translations);
    race.theirs_s = std::min(race.theirs_s, seconds_since(start));
  }
  return race;
}

}  // namespace striper::testing
