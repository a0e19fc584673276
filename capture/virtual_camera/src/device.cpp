// SPDX-License-Identifier: Apache-2.0
// The virtual camera from its making to its end: sockets, threads and what it says of itself.
#include "device.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <striper/core/error.hpp>

#include "genicam_xml.hpp"
#include "gige/pictures/pixel_layout.hpp"
#include "gige/protocol/udp_socket.hpp"

namespace striper::detail {
namespace {

constexpr std::uint32_t kDefaultHeartbeat_ms = 3000;
constexpr std::uint32_t kDefaultPacket_bytes = 1400;

std::uint32_t parse_loopback(const std::string& text) {
  std::uint32_t address = 0;
  if (gvcp::parse_ip(text, address) && (address & kLoopbackMask) == kLoopback) return address;
  throw Error(ErrorKind::kBadValue,
              fmt::format("virtual camera: address={} - expected one of 127.0.0.0/8", text));
}

int bound_socket(std::uint32_t address) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const sockaddr_in local = socket_address(address, gvcp::kPort);
  if (address == INADDR_BROADCAST) {
    // Several cameras hear one broadcast; an address of its own has only one.
    const int yes = 1;
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  }
  if (fd >= 0 && bind(fd, reinterpret_cast<const sockaddr*>(&local), sizeof(local)) == 0) return fd;
  const std::string why = std::strerror(errno);
  if (fd >= 0) close(fd);
  throw Error(ErrorKind::kDevice,
              fmt::format("virtual camera: cannot listen at {}:{}: {} (another camera has this "
                          "address: take another one of 127.0.0.0/8)",
                          gvcp::to_string_ip(address), gvcp::kPort, why));
}

std::uint32_t default_pixel_format(int bit_depth) {
  switch (bit_depth) {
    case 8:
      return find_layout("Mono8")->code;
    case 10:
      return find_layout("Mono10")->code;
    case 12:
      return find_layout("Mono12")->code;
    case 14:
      return find_layout("Mono14")->code;
    default:
      return find_layout("Mono16")->code;
  }
}

}  // namespace

Device::Device(std::shared_ptr<VirtualScene> scene, VirtualCameraOptions options,
               CameraFaults faults)
    : scene_(std::move(scene)),
      options_(std::move(options)),
      faults_(std::move(faults)),
      address_(parse_loopback(options_.address)),
      xml_(genicam_xml(faults_.lacking)),
      sender_(address_, options_.link_mbit_s),
      log_(register_names(faults_.lacking)) {
  sender_.lost_packets = options_.lost_packets;
  state_.sensor = scene_->sensor_size();
  state_.region = cv::Rect(cv::Point(0, 0), state_.sensor);
  state_.pixel_format = default_pixel_format(scene_->bit_depth());
  state_.exposure_ns = static_cast<std::uint32_t>(std::llround(1e3 * scene_->shutter_us()));
  state_.rate_mhz = static_cast<std::uint32_t>(std::lround(1e3 * scene_->rate_hz()));
  features_ = feature_registers(
      state_,
      {[this](bool is_acquiring) { acquire(is_acquiring); },
       [this](TriggerSource source) { trigger(source); },
       [this] { return static_cast<std::uint32_t>(std::lround(1e6 * sender_.lost_packets)); },
       [this](std::uint32_t ppm) { sender_.lost_packets = 1e-6 * ppm; }});
  fill_bootstrap();
  open_sockets();
  control_thread_ = std::thread(&Device::run_control, this);
  stream_thread_ = std::thread(&Device::run_stream, this);
}

Device::~Device() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  control_thread_.join();
  stream_thread_.join();
  close(control_fd_);
  close(broadcast_fd_);
}

void Device::open_sockets() {
  control_fd_ = bound_socket(address_);
  try {
    broadcast_fd_ = bound_socket(INADDR_BROADCAST);
  } catch (...) {
    close(control_fd_);
    throw;
  }
}

void Device::put_text(std::uint32_t address, const std::string& text, std::size_t size) {
  std::copy_n(text.begin(), std::min(text.size(), size - 1), bootstrap_.begin() + address);
}

void Device::put_word(std::uint32_t address, std::uint32_t value) {
  gvcp::put32(&bootstrap_[address], value);
}

std::uint32_t Device::word(std::uint32_t address) const {
  return gvcp::get32(&bootstrap_[address]);
}

void Device::fill_bootstrap() {
  bootstrap_.assign(kBootstrapBytes, 0);
  put_word(gvcp::kVersion, 0x00010002);
  put_word(gvcp::kDeviceMode, 0x80000001);  // big-endian, UTF-8
  put_word(gvcp::kMacHigh, 0x0200);         // locally administered, then the address
  put_word(gvcp::kMacLow, address_);
  put_word(gvcp::kIpConfigurationOptions, 1);
  put_word(gvcp::kIpConfiguration, 1);
  put_word(gvcp::kCurrentIp, address_);
  put_word(gvcp::kCurrentMask, kLoopbackMask);
  put_text(gvcp::kManufacturer, "Striper", 32);
  put_text(gvcp::kModel, "VirtualStriper", 32);
  put_text(gvcp::kDeviceVersion, "1", 32);
  put_text(gvcp::kManufacturerInfo, "simulated", 48);
  put_text(gvcp::kSerial, options_.serial, 16);
  put_text(gvcp::kUserName, options_.user_name, 16);
  put_text(gvcp::kFirstUrl,
           fmt::format("Local:virtual_striper.xml;{:x};{:x}", kXmlAddress, xml_.size()), 512);
  put_word(gvcp::kInterfaceCount, 1);
  put_word(gvcp::kStreamChannelCount, 1);
  put_word(gvcp::kActionSignalCount, 1);
  constexpr std::uint32_t kCapabilities =
      (1U << 31) | (1U << 30) | (1U << 6) | (1U << 1) | (1U << 0);
  put_word(gvcp::kCapability, kCapabilities | (options_.can_resend ? 1U << 2 : 0U));
  put_word(gvcp::kHeartbeatTimeout, kDefaultHeartbeat_ms);
  put_word(gvcp::kTickFrequencyLow, 1'000'000'000);
  put_word(gvcp::kStreamPacketSize, kDefaultPacket_bytes);
  put_word(gvcp::kStreamSourcePort, sender_.local_port());
}

void Device::set_silent(bool is_silent) {
  is_silent_ = is_silent;
  sender_.is_silent = is_silent;
}

void Device::set_stuck(std::set<std::string> features) {
  const std::lock_guard lock(mutex_);
  faults_.stuck = std::move(features);
}

void Device::forget_controller() {
  const std::lock_guard lock(mutex_);
  drop_control();
}

VirtualCameraStatistics Device::statistics() const {
  const std::lock_guard lock(mutex_);
  VirtualCameraStatistics result;
  result.frames = frames_;
  result.packets = sender_.packets;
  result.lost = sender_.lost;
  result.resent = sender_.resent;
  result.controllers = controllers_;
  result.is_controlled = is_controlled_;
  result.is_streaming = state_.is_acquiring;
  result.is_laser_armed = state_.is_laser_armed();
  return result;
}

std::vector<RegisterWrite> Device::register_writes() const {
  const std::lock_guard lock(mutex_);
  return log_.writes();
}

}  // namespace striper::detail
