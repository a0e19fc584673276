// SPDX-License-Identifier: Apache-2.0
// The virtual camera's side of the control protocol.
#include <algorithm>
#include <array>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <striper/core/error.hpp>

#include "gige/host_clock.hpp"
#include "gige/pixel_layout.hpp"
#include "gige/virtual/device.hpp"
#include "gige/virtual/genicam_xml.hpp"

namespace striper::detail {
namespace {

constexpr std::size_t kBootstrapBytes = 0x1000;
constexpr std::uint32_t kDefaultHeartbeat_ms = 3000;
constexpr std::uint32_t kDefaultPacket_bytes = 1400;
constexpr std::uint32_t kLoopbackMask = 0xff000000;
constexpr std::uint32_t kLoopback = 0x7f000000;
constexpr std::size_t kPacketOverhead = 28;  // IP and UDP

std::uint32_t parse_loopback(const std::string& text) {
  std::uint32_t address = 0;
  if (gvcp::parse_ip(text, address) && (address & kLoopbackMask) == kLoopback) return address;
  throw Error(ErrorKind::kBadValue,
              fmt::format("virtual camera: address={} - expected one of 127.0.0.0/8", text));
}

int bound_socket(std::uint32_t address) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_in local{};
  local.sin_family = AF_INET;
  local.sin_port = htons(gvcp::kPort);
  local.sin_addr.s_addr = htonl(address);
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

Device::Device(std::shared_ptr<VirtualScene> scene, VirtualCameraOptions options)
    : scene_(std::move(scene)),
      options_(std::move(options)),
      address_(parse_loopback(options_.address)),
      xml_(genicam_xml(options_.lacking)),
      sender_(address_, options_.link_mbit_s, options_.seed) {
  sender_.lost_packets = options_.lost_packets;
  sender_.lost_resends = options_.lost_resends;
  state_.sensor = scene_->sensor_size();
  state_.region = cv::Rect(cv::Point(0, 0), state_.sensor);
  state_.pixel_format = default_pixel_format(scene_->bit_depth());
  state_.rate_mhz = static_cast<std::uint32_t>(std::lround(1e3 * scene_->rate_hz()));
  features_ = feature_registers(
      state_,
      {[this](bool is_acquiring) { acquire(is_acquiring); }, [this] { ++triggers_; },
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
  constexpr std::uint32_t kCapabilities = (1U << 31) | (1U << 30) | (1U << 1) | (1U << 0);
  put_word(gvcp::kCapability, kCapabilities | (options_.can_resend ? 1U << 2 : 0U));
  put_word(gvcp::kHeartbeatTimeout, kDefaultHeartbeat_ms);
  put_word(gvcp::kTickFrequencyLow, 1'000'000'000);
  put_word(gvcp::kStreamPacketSize, kDefaultPacket_bytes);
  put_word(gvcp::kStreamSourcePort, sender_.local_port());
}

void Device::run_control() {
  std::array<pollfd, 2> waiting{pollfd{control_fd_, POLLIN, 0}, pollfd{broadcast_fd_, POLLIN, 0}};
  while (!is_ending_) {
    poll(waiting.data(), waiting.size(), 50);
    answer_packets(control_fd_);
    answer_packets(broadcast_fd_);
    const std::lock_guard lock(mutex_);
    const std::int64_t silence_ns = monotonic_now_ns() - heard_at_ns_;
    const std::int64_t patience_ns = 1'000'000LL * word(gvcp::kHeartbeatTimeout);
    if (is_controlled_ && silence_ns > patience_ns) drop_control();
  }
}

void Device::answer_packets(int fd) {
  std::array<std::uint8_t, 1024> request;
  sockaddr_in from{};
  socklen_t length = sizeof(from);
  while (true) {
    const ssize_t size = recvfrom(fd, request.data(), request.size(), 0,
                                  reinterpret_cast<sockaddr*>(&from), &length);
    if (size <= 0) return;
    const bool is_ours = (ntohl(from.sin_addr.s_addr) & kLoopbackMask) == kLoopback;
    if (is_ours && !is_silent_) {
      answer({request.data(), static_cast<std::size_t>(size)}, from);
    }
  }
}

void Device::answer(std::span<const std::uint8_t> request, const sockaddr_in& from) {
  if (request.size() < gvcp::kHeaderBytes || request[0] != gvcp::kKey) return;
  const std::uint16_t command = gvcp::get16(&request[2]);
  const std::size_t length = gvcp::get16(&request[4]);
  if (request.size() < gvcp::kHeaderBytes + length) return;

  Answer result(gvcp::kHeaderBytes);
  std::uint16_t status = gvcp::kSuccess;
  {
    const std::lock_guard lock(mutex_);
    const Client client{ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
    if (is_controlled_ && client == controller_) heard_at_ns_ = monotonic_now_ns();
    status = execute(command, request.subspan(gvcp::kHeaderBytes, length), client, result);
  }
  changed_.notify_all();
  if ((request[1] & gvcp::kAckRequired) == 0) return;
  if (status != gvcp::kSuccess) result.resize(gvcp::kHeaderBytes);
  gvcp::put16(&result[0], status);
  gvcp::put16(&result[2], command + 1U);
  gvcp::put16(&result[4], static_cast<std::uint32_t>(result.size() - gvcp::kHeaderBytes));
  std::copy_n(&request[6], 2, &result[6]);
  sendto(control_fd_, result.data(), result.size(), 0, reinterpret_cast<const sockaddr*>(&from),
         sizeof(from));
}

std::uint16_t Device::execute(std::uint16_t command, std::span<const std::uint8_t> data,
                              const Client& client, Answer& result) {
  switch (command) {
    case gvcp::kDiscovery:
      result.insert(result.end(), bootstrap_.begin(), bootstrap_.begin() + gvcp::kDiscoveryEnd);
      return gvcp::kSuccess;
    case gvcp::kReadRegister:
      return read_registers(data, result);
    case gvcp::kWriteRegister:
      return write_registers(data, client, result);
    case gvcp::kReadMemory:
      return read_memory(data, result);
    case gvcp::kWriteMemory:
      return write_memory(data, client, result);
    case gvcp::kPacketResend:
      return resend(data);
    default:
      return gvcp::kNotImplemented;
  }
}

std::uint16_t Device::read_registers(std::span<const std::uint8_t> data, Answer& result) {
  for (; data.size() >= 4; data = data.subspan(4)) {
    std::uint32_t value = 0;
    const std::uint16_t status = read_word(gvcp::get32(data.data()), value);
    if (status != gvcp::kSuccess) return status;
    result.resize(result.size() + 4);
    gvcp::put32(&result[result.size() - 4], value);
  }
  return gvcp::kSuccess;
}

std::uint16_t Device::write_registers(std::span<const std::uint8_t> data, const Client& client,
                                      Answer& result) {
  std::uint32_t written = 0;
  for (; data.size() >= 8; data = data.subspan(8), ++written) {
    const std::uint16_t status =
        write_word(gvcp::get32(data.data()), gvcp::get32(&data[4]), client);
    if (status != gvcp::kSuccess) return status;
  }
  result.resize(result.size() + 4);
  gvcp::put32(&result[result.size() - 4], written);
  return gvcp::kSuccess;
}

std::uint16_t Device::read_memory(std::span<const std::uint8_t> data, Answer& result) {
  if (data.size() < 8) return gvcp::kInvalidParameter;
  const std::uint32_t address = gvcp::get32(data.data());
  const std::uint32_t count = gvcp::get32(&data[4]) & 0xffff;
  if (count > gvcp::kLargestRead || count % 4 != 0) return gvcp::kInvalidParameter;
  if (address % 4 != 0) return gvcp::kBadAlignment;
  result.insert(result.end(), data.begin(), data.begin() + 4);
  for (std::uint32_t at = address; at < address + count; at += 4) {
    std::uint32_t value = 0;
    const std::uint16_t status = read_word(at, value);
    if (status != gvcp::kSuccess) return status;
    result.resize(result.size() + 4);
    gvcp::put32(&result[result.size() - 4], value);
  }
  return gvcp::kSuccess;
}

std::uint16_t Device::write_memory(std::span<const std::uint8_t> data, const Client& client,
                                   Answer& result) {
  if (data.size() < 8 || data.size() % 4 != 0) return gvcp::kInvalidParameter;
  const std::uint32_t address = gvcp::get32(data.data());
  for (std::size_t at = 4; at < data.size(); at += 4) {
    const std::uint16_t status =
        write_word(address + static_cast<std::uint32_t>(at) - 4, gvcp::get32(&data[at]), client);
    if (status != gvcp::kSuccess) return status;
  }
  result.resize(result.size() + 4);
  gvcp::put32(&result[result.size() - 4], static_cast<std::uint32_t>(data.size() - 4));
  return gvcp::kSuccess;
}

std::uint16_t Device::resend(std::span<const std::uint8_t> data) {
  if (data.size() < 12) return gvcp::kInvalidParameter;
  if (!options_.can_resend) return gvcp::kNotImplemented;
  const bool is_kept = sender_.resend(gvcp::get16(&data[2]), gvcp::get32(&data[4]) & 0xffffff,
                                      gvcp::get32(&data[8]) & 0xffffff, stream_destination());
  return is_kept ? gvcp::kSuccess : gvcp::kPacketUnavailable;
}

std::uint16_t Device::read_word(std::uint32_t address, std::uint32_t& value) {
  if (address % 4 != 0) return gvcp::kBadAlignment;
  if (address < kBootstrapBytes) {
    value = word(address);
    return gvcp::kSuccess;
  }
  if (address >= kXmlAddress && address < kXmlAddress + xml_.size()) {
    std::array<std::uint8_t, 4> bytes{};
    const std::size_t at = address - kXmlAddress;
    std::copy_n(xml_.begin() + static_cast<std::ptrdiff_t>(at),
                std::min<std::size_t>(4, xml_.size() - at), bytes.begin());
    value = gvcp::get32(bytes.data());
    return gvcp::kSuccess;
  }
  const auto found = features_.find(address);
  if (found == features_.end()) return gvcp::kInvalidAddress;
  value = found->second.get();
  return gvcp::kSuccess;
}

std::uint16_t Device::write_word(std::uint32_t address, std::uint32_t value, const Client& client) {
  if (address == gvcp::kControlPrivilege) return write_privilege(value, client);
  if (!is_controlled_ || !(client == controller_)) return gvcp::kAccessDenied;
  switch (address) {
    case gvcp::kTimestampControl:
      if ((value & 2) != 0) latch_timestamp();
      return gvcp::kSuccess;
    case gvcp::kStreamPacketSize:
      return write_packet_size(value);
    case gvcp::kHeartbeatTimeout:
    case gvcp::kStreamPort:
    case gvcp::kStreamPacketDelay:
    case gvcp::kStreamDestination:
      put_word(address, value);
      return gvcp::kSuccess;
    default:
      break;
  }
  if (address < kBootstrapBytes) return gvcp::kWriteProtect;
  const auto found = features_.find(address);
  if (found == features_.end()) return gvcp::kInvalidAddress;
  if (!found->second.set) return gvcp::kWriteProtect;
  return found->second.set(value) ? gvcp::kSuccess : gvcp::kInvalidParameter;
}

std::uint16_t Device::write_privilege(std::uint32_t value, const Client& client) {
  const bool wants = (value & (gvcp::kControl | gvcp::kExclusive)) != 0;
  if (is_controlled_ && !(client == controller_)) return gvcp::kAccessDenied;
  if (!wants) {
    if (is_controlled_) drop_control();
    return gvcp::kSuccess;
  }
  if (!is_controlled_) {
    ++controllers_;
    state_.lines_off();
    state_.lines_are_commanded = false;
  }
  is_controlled_ = true;
  controller_ = client;
  heard_at_ns_ = monotonic_now_ns();
  put_word(gvcp::kControlPrivilege, value & (gvcp::kControl | gvcp::kExclusive));
  put_word(gvcp::kPrimaryIp, client.address);
  put_word(gvcp::kPrimaryPort, client.port);
  return gvcp::kSuccess;
}

std::uint16_t Device::write_packet_size(std::uint32_t value) {
  const std::uint32_t bytes = value & 0xffff;
  if (bytes < 576) return gvcp::kInvalidParameter;
  put_word(gvcp::kStreamPacketSize, value & ~gvcp::kFireTestPacket);
  const bool gets_through = bytes <= static_cast<std::uint32_t>(options_.mtu);
  if ((value & gvcp::kFireTestPacket) != 0 && gets_through) {
    sender_.send_test_packet(bytes - kPacketOverhead, stream_destination());
  }
  return gvcp::kSuccess;
}

void Device::latch_timestamp() {
  const auto now = static_cast<std::uint64_t>(device_time_ns(monotonic_now_ns()));
  put_word(gvcp::kTimestampHigh, static_cast<std::uint32_t>(now >> 32));
  put_word(gvcp::kTimestampLow, static_cast<std::uint32_t>(now));
}

/// Nobody is in control any more: no stream, and above all no light.
void Device::drop_control() {
  is_controlled_ = false;
  controller_ = {};
  put_word(gvcp::kControlPrivilege, 0);
  put_word(gvcp::kPrimaryIp, 0);
  put_word(gvcp::kPrimaryPort, 0);
  put_word(gvcp::kStreamPort, 0);
  state_.is_acquiring = false;
  state_.lines_off();
}

sockaddr_in Device::stream_destination() const {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(word(gvcp::kStreamPort) & 0xffff));
  to.sin_addr.s_addr = htonl(word(gvcp::kStreamDestination));
  return to;
}

void Device::set_silent(bool is_silent) {
  is_silent_ = is_silent;
  sender_.is_silent = is_silent;
}

void Device::forget_controller() {
  const std::lock_guard lock(mutex_);
  drop_control();
}

VirtualCameraStatistics Device::statistics() const {
  const std::lock_guard lock(mutex_);
  VirtualCameraStatistics result;
  result.pictures = pictures_;
  result.packets = sender_.packets;
  result.lost = sender_.lost;
  result.resent = sender_.resent;
  result.controllers = controllers_;
  result.is_controlled = is_controlled_;
  result.is_streaming = state_.is_acquiring;
  bool any_set_fires = false;
  for (const SequencerSet& set : state_.sets) {
    any_set_fires = any_set_fires || (state_.line_status(set.sources) >> kFirstLaserLine) != 0;
  }
  result.is_laser_armed = (state_.line_status(state_.sources) >> kFirstLaserLine) != 0 ||
                          (state_.sequencer_is_on && any_set_fires);
  return result;
}

}  // namespace striper::detail
