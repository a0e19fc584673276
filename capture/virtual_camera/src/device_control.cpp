// SPDX-License-Identifier: Apache-2.0
// The virtual camera's side of the control protocol.
#include <algorithm>
#include <array>

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

#include "device.hpp"
#include "gige/protocol/udp_socket.hpp"
#include "live/host_clock.hpp"

namespace striper::detail {
namespace {

constexpr std::size_t kPacketOverhead = 28;  // IP and UDP
constexpr std::uint16_t kNoAnswer = 0xffff;  // instead of a status: a command for somebody else

}  // namespace

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
  if ((request[1] & gvcp::kAckRequired) == 0 || status == kNoAnswer) return;
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
    case gvcp::kAction:
      return act(data);
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

/// Anybody may trigger who knows the keys, while somebody controls the camera.
std::uint16_t Device::act(std::span<const std::uint8_t> data) {
  if (data.size() < 12) return gvcp::kInvalidParameter;
  const bool is_meant = is_controlled_ &&
                        gvcp::get32(data.data()) == word(gvcp::kActionDeviceKey) &&
                        gvcp::get32(&data[4]) == state_.action_group_key &&
                        (gvcp::get32(&data[8]) & state_.action_group_mask) != 0;
  if (!is_meant) return kNoAnswer;
  trigger(TriggerSource::kAction1);
  return gvcp::kSuccess;
}

std::uint16_t Device::read_word(std::uint32_t address, std::uint32_t& value) {
  if (address % 4 != 0) return gvcp::kBadAlignment;
  if (address == gvcp::kActionDeviceKey) return gvcp::kAccessDenied;
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
  const bool is_privilege = address == gvcp::kControlPrivilege;
  const bool is_ours = is_controlled_ && client == controller_;
  if (!is_privilege && !is_ours) return gvcp::kAccessDenied;
  if (faults_.stuck.count(log_.name_of(address, value)) != 0) return gvcp::kSuccess;
  const std::uint16_t status = is_privilege                ? write_privilege(value, client)
                               : address < kBootstrapBytes ? write_bootstrap(address, value)
                                                           : write_feature(address, value);
  if (status == gvcp::kSuccess) log_.note(controllers_, address, value, state_.is_laser_armed());
  return status;
}

std::uint16_t Device::write_bootstrap(std::uint32_t address, std::uint32_t value) {
  switch (address) {
    case gvcp::kTimestampControl:
      if ((value & 2) != 0) latch_timestamp();
      return gvcp::kSuccess;
    case gvcp::kStreamPacketSize:
      return write_packet_size(value);
    case gvcp::kActionDeviceKey:
    case gvcp::kHeartbeatTimeout:
    case gvcp::kStreamPort:
    case gvcp::kStreamPacketDelay:
    case gvcp::kStreamDestination:
      put_word(address, value);
      return gvcp::kSuccess;
    default:
      return gvcp::kWriteProtect;
  }
}

std::uint16_t Device::write_feature(std::uint32_t address, std::uint32_t value) {
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
  const auto now = static_cast<std::uint64_t>(device_time_ns(state_, monotonic_now_ns()));
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
  return socket_address(word(gvcp::kStreamDestination),
                        static_cast<std::uint16_t>(word(gvcp::kStreamPort) & 0xffff));
}

}  // namespace striper::detail
