// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/virtual_camera/virtual_camera.hpp>

#include "device.hpp"

namespace striper {

void VirtualCameraOptions::validate() const {
  const auto check = [](bool is_good, const char* field, const std::string& value,
                        const char* expected) {
    if (is_good) return;
    throw Error(ErrorKind::kBadValue,
                fmt::format("virtual camera: {}={} - expected {}", field, value, expected));
  };
  check(lost_packets >= 0.0 && lost_packets <= 1.0, "lost_packets", fmt::format("{}", lost_packets),
        "0 to 1");
  check(mtu >= 576 && mtu <= 65535, "mtu", fmt::format("{}", mtu), "576 to 65535");
  check(link_mbit_s > 0.0, "link_mbit_s", fmt::format("{}", link_mbit_s), "more than 0");
  check(clock_skew > -0.01 && clock_skew < 0.01, "clock_skew", fmt::format("{}", clock_skew),
        "-0.01 to 0.01");
  check(!serial.empty() && serial.size() < 16, "serial", serial, "1 to 15 characters");
  check(user_name.size() < 16, "user_name", user_name, "at most 15 characters");
}

class VirtualCamera::Impl : public detail::Device {
 public:
  using Device::Device;
};

VirtualCamera::VirtualCamera(std::shared_ptr<VirtualScene> scene, VirtualCameraOptions options) {
  options.validate();
  impl_ = std::make_unique<Impl>(std::move(scene), std::move(options));
}

VirtualCamera::~VirtualCamera() = default;

VirtualCameraStatistics VirtualCamera::statistics() const { return impl_->statistics(); }
std::vector<RegisterWrite> VirtualCamera::register_writes() const {
  return impl_->register_writes();
}

}  // namespace striper
