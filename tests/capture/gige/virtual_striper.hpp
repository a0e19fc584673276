// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core/mat.hpp>
#include <unistd.h>

#include <striper/capture/open_source.hpp>
#include <striper/gige/gige_source.hpp>
#include <striper/virtual_camera/virtual_camera.hpp>

#include "virtual_camera/src/device.hpp"

namespace striper::testing {

/// An address of this machine that no other test program uses: GigE Vision has one port, so every
/// camera needs an address of its own.
inline std::string own_address() {
  static std::atomic<int> count = 0;
  const int process = static_cast<int>(getpid());
  return fmt::format("127.{}.{}.{}", 16 + process % 200, process / 200 % 250 + 1,
                     count++ % 250 + 1);
}

/// A scene whose every pixel tells the image's number, its light and where it is.
class PatternScene : public VirtualScene {
 public:
  PatternScene(cv::Size size, int bit_depth, double rate_hz)
      : size_(size), bit_depth_(bit_depth), rate_hz_(rate_hz) {}

  cv::Size sensor_size() const override { return size_; }
  int bit_depth() const override { return bit_depth_; }
  double rate_hz() const override { return rate_hz_; }
  IlluminationPattern pattern() const override {
    return IlluminationPattern({Illumination::laser(0)});
  }
  cv::Mat image(std::uint64_t n, Illumination light, double /*exposure_us*/) override {
    return expected(size_, bit_depth_, n, light);
  }

  static cv::Mat expected(cv::Size size, int bit_depth, std::uint64_t n, Illumination light) {
    const auto salt = static_cast<std::uint32_t>(n * 2654435761U + (light.is_lit() ? 7 : 99));
    const std::uint32_t mask = (1U << bit_depth) - 1;
    cv::Mat pixels(size, bit_depth > 8 ? CV_16UC1 : CV_8UC1);
    for (int v = 0; v < size.height; ++v) {
      for (int u = 0; u < size.width; ++u) {
        const std::uint32_t value =
            (salt + static_cast<std::uint32_t>(u) * 40503U + static_cast<std::uint32_t>(v) * 9973U);
        const std::uint32_t mixed = (value ^ (value >> 13)) & mask;
        if (bit_depth > 8) {
          pixels.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(mixed);
        } else {
          pixels.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(mixed);
        }
      }
    }
    return pixels;
  }

 private:
  cv::Size size_;
  int bit_depth_;
  double rate_hz_;
};

/// A virtual camera at an address of its own, and sources that open it.
struct VirtualStriper {
  explicit VirtualStriper(std::shared_ptr<VirtualScene> shown, VirtualCameraOptions given = {},
                          detail::CameraFaults wrong = {})
      : scene(std::move(shown)), options(std::move(given)), faults(std::move(wrong)) {
    options.address = own_address();
    options.serial = fmt::format("T{}", getpid() % 100000);
    plug_in();
  }

  void plug_in() { camera = std::make_unique<detail::Device>(scene, options, faults); }
  void pull_the_plug() { camera.reset(); }

  /// A machine that is busy with other tests is no reason to give a frame up.
  std::string uri(const std::string& query = "") const {
    return fmt::format("gige:{}?frame_timeout_ms=1500{}{}", options.address,
                       query.empty() ? "" : "&", query);
  }
  std::unique_ptr<GigeSource> open(const std::string& query = "",
                                   const EventPort& events = {}) const {
    GigeOptions opened = GigeOptions::from_uri(SourceUri::parse(uri(query)));
    opened.events = events;
    return std::make_unique<GigeSource>(opened);
  }

  std::shared_ptr<VirtualScene> scene;
  VirtualCameraOptions options;
  detail::CameraFaults faults;
  std::unique_ptr<detail::Device> camera;  ///< What VirtualCamera has inside: it can be faulty.
};

}  // namespace striper::testing
