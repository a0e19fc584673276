// SPDX-License-Identifier: Apache-2.0
#include "support/colour_camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <opencv2/core.hpp>

#include <striper/core/frame.hpp>

namespace striper::testing {
namespace {

Scene with_laser_alone(Scene scene) {
  scene.daylight = Daylight{};
  for (SceneObject& object : scene.objects) object.material.radiance_w_m2_sr_nm = 0.0;
  return scene;
}

/// Standard normal numbers, two at a time (Box and Muller 1958).
class Normals {
 public:
  explicit Normals(std::uint64_t seed) : dice_(seed) {}

  double next() {
    has_second_ = !has_second_;
    if (!has_second_) return second_;
    const double radius = std::sqrt(-2.0 * std::log(1.0 - dice_.between(0.0, 1.0)));
    const double angle = 2.0 * std::numbers::pi * dice_.between(0.0, 1.0);
    second_ = radius * std::sin(angle);
    return radius * std::cos(angle);
  }

 private:
  SceneDice dice_;
  bool has_second_ = false;
  double second_ = 0.0;
};

void expose(const cv::Mat& expected, const Imager& imager, Normals& normals, cv::Mat& out) {
  const double read_dn = imager.noise.read_noise_e * imager.dn_per_electron;
  const double full = full_scale_dn(imager.bit_depth);
  cv::Mat noisy(expected.size(), CV_32F);
  for (int v = 0; v < expected.rows; ++v) {
    for (int u = 0; u < expected.cols; ++u) {
      const double dn = expected.at<float>(v, u);
      const double light_dn = std::max(0.0, dn - imager.black_level_dn);
      const double sigma = std::sqrt(read_dn * read_dn + imager.dn_per_electron * light_dn);
      const double value = dn + sigma * normals.next();
      noisy.at<float>(v, u) = static_cast<float>(std::clamp(std::round(value), 0.0, full));
    }
  }
  noisy.convertTo(out, imager.bit_depth > 8 ? CV_16U : CV_8U);
}

}  // namespace

ColourCamera::ColourCamera(const Scene& scene, Laser colour)
    : laser_(with_laser_alone(scene)), other_(without_laser(scene)) {
  SceneDice dice(scene.seed + 0xC01);
  own_ = colour == Laser::kRed ? 2 : 1;
  share_ = colour == Laser::kRed ? std::array{0.05, 0.1, 1.0} : std::array{0.1, 1.0, 0.1};
  for (double& tint : tint_) tint = dice.between(0.6, 1.1);
}

cv::Mat ColourCamera::channel_dn(const cv::Mat& laser_dn, const cv::Mat& other_dn,
                                 int channel) const {
  const double black = laser_.scene().imager.black_level_dn;
  const auto i = static_cast<std::size_t>(channel);
  return cv::Mat((laser_dn - black) * share_[i] + (other_dn - black) * tint_[i] + black);
}

cv::Mat ColourCamera::expected_dn(std::uint64_t number) {
  return channel_dn(laser_.expected_dn(number), other_.expected_dn(number), own_);
}

Frame ColourCamera::render(std::uint64_t number) {
  Frame frame = other_.render(number);
  const cv::Mat laser_dn = laser_.expected_dn(number);
  const cv::Mat other_dn = other_.expected_dn(number);
  Normals normals(laser_.scene().seed * 1000 + number);
  std::vector<cv::Mat> channels(3);
  for (int i = 0; i < 3; ++i) {
    expose(channel_dn(laser_dn, other_dn, i), laser_.scene().imager, normals,
           channels[static_cast<std::size_t>(i)]);
  }
  cv::merge(channels, frame.image);
  return frame;
}

}  // namespace striper::testing
