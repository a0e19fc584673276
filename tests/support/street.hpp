// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>

#include "support/random.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper::testing {

/// A textured street that moves sideways past a camera, with stripes of lasers that fire in turn.
/// Cheap to make, and every light in it is known; the simulator's scenes are the real thing.
struct Street {
  cv::Size size = {320, 240};
  IlluminationPattern pattern = IlluminationPattern::parse("0,dark");
  Field field = Field::kProgressive;  ///< Or one of the two interlaced ones.

  double daylight_dn = 80.0;  ///< Mean of the background.
  double texture_dn = 25.0;   ///< Its standard deviation; grain of about `grain_px`.
  double grain_px = 3.0;
  double edge_dn = 0.0;        ///< Height of boxes that stand in the street.
  double speed_px = 0.0;       ///< Sideways, per exposure.
  double amplitude_dn = 40.0;  ///< Of each laser's stripe; 0: nothing to be seen of it.
  double sigma_px = 1.5;
  double noise_dn = 2.0;
  int bit_depth = 8;
  /// Row of a laser's stripe in the full frame.
  std::function<double(int laser, int column)> row = [](int laser, int column) {
    return 120.0 + 40.0 * laser + 12.0 * std::sin(column / 40.0);
  };
  std::vector<cv::Vec3d>
      light_sources;  ///< Saturating discs: column, row, radius; they move along.

  /// The world that passes by; made by `build`.
  cv::Mat world;

  void build() {
    world = cv::Mat(size.height, 4096, CV_32F);
    for (int v = 0; v < world.rows; ++v) {
      for (int u = 0; u < world.cols; ++u) world.at<float>(v, u) = static_cast<float>(normal());
    }
    cv::GaussianBlur(world, world, {}, grain_px / 2.0);
    cv::Scalar mean;
    cv::Scalar deviation;
    cv::meanStdDev(world, mean, deviation);
    world = world * (texture_dn / deviation[0]) + daylight_dn;
    if (edge_dn <= 0.0) return;
    for (int i = 0; i < 160; ++i) {
      const cv::Rect box(static_cast<int>(uniform(0, 4000)), static_cast<int>(uniform(0, 200)),
                         static_cast<int>(uniform(5, 60)), static_cast<int>(uniform(5, 60)));
      world(box & cv::Rect(0, 0, world.cols, world.rows)) += edge_dn * (i % 2 == 0 ? 1.0 : -1.0);
    }
  }

  /// The light of exposure `number`, before noise, full frame.
  cv::Mat light(std::uint64_t number) const {
    const int shift = static_cast<int>(std::lround(speed_px * static_cast<double>(number % 512)));
    const int left = shift % (world.cols - size.width);
    cv::Mat image = world(cv::Rect(left, 0, size.width, size.height)).clone();
    for (const cv::Vec3d& light_source : light_sources) {
      cv::circle(image,
                 {static_cast<int>(light_source[0]) - shift, static_cast<int>(light_source[1])},
                 static_cast<int>(light_source[2]), 1e4, cv::FILLED);
    }
    const Illumination lit = pattern.at(number);
    if (!lit.is_lit() || amplitude_dn <= 0.0) return image;
    for (int u = 0; u < image.cols; ++u) {
      const double mu = row(lit.laser_index(), u);
      const int reach = static_cast<int>(5.0 * sigma_px) + 1;
      const int last = std::min(image.rows - 1, static_cast<int>(mu) + reach);
      for (int v = std::max(0, static_cast<int>(mu) - reach); v <= last; ++v) {
        image.at<float>(v, u) += static_cast<float>(box_gaussian(v, mu, sigma_px, amplitude_dn));
      }
    }
    return image;
  }

  void expose(const cv::Mat& light, int first_row, int step, cv::Mat& out) const {
    const double full = full_scale_dn(bit_depth);
    for (int v = first_row; v < light.rows; v += step) {
      for (int u = 0; u < light.cols; ++u) {
        const double dn = light.at<float>(v, u) + normal(0.0, noise_dn);
        const double clipped = std::clamp(std::round(dn), 0.0, full);
        if (bit_depth > 8) {
          out.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(clipped);
        } else {
          out.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(clipped);
        }
      }
    }
  }

  /// Frame `sequence`, its illumination unknown.
  Frame frame(std::uint64_t sequence) const {
    constexpr std::int64_t kPeriodNs = 33'366'667;
    Frame frame;
    frame.image = cv::Mat(size, bit_depth > 8 ? CV_16UC1 : CV_8UC1);
    frame.bit_depth = bit_depth;
    frame.sensor_size = size;
    frame.sequence = sequence;
    frame.field = field;
    frame.time.monotonic_ns = static_cast<std::int64_t>(sequence) * kPeriodNs;
    if (field == Field::kProgressive) {
      expose(light(sequence), 0, 1, frame.image);
      return frame;
    }
    frame.exposures_per_picture = 2;
    frame.field_period_ns = kPeriodNs / 2;
    const int first = field == Field::kInterlacedTopFirst ? 0 : 1;
    expose(light(2 * sequence), first, 2, frame.image);
    expose(light(2 * sequence + 1), 1 - first, 2, frame.image);
    return frame;
  }
};

}  // namespace striper::testing
