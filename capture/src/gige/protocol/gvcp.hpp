// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

// The words of the GigE Vision control protocol (GVCP), GigE Vision 1.2: what our own client and
// the virtual camera both speak. All numbers on the wire are big-endian.
namespace striper::detail::gvcp {

inline constexpr std::uint16_t kPort = 3956;
inline constexpr std::uint8_t kKey = 0x42;
inline constexpr std::uint8_t kAckRequired = 0x01;
inline constexpr std::uint8_t kMayBroadcastAnswer = 0x10;  // of a discovery
inline constexpr std::size_t kHeaderBytes = 8;
inline constexpr std::size_t kLargestPacket = 576;
inline constexpr std::size_t kLargestRead = 536;

enum Command : std::uint16_t {
  kDiscovery = 0x0002,
  kPacketResend = 0x0040,
  kReadRegister = 0x0080,
  kWriteRegister = 0x0082,
  kReadMemory = 0x0084,
  kWriteMemory = 0x0086,
  kAction = 0x0100,
};

enum Status : std::uint16_t {
  kSuccess = 0x0000,
  kNotImplemented = 0x8001,
  kInvalidParameter = 0x8002,
  kInvalidAddress = 0x8003,
  kWriteProtect = 0x8004,
  kBadAlignment = 0x8005,
  kAccessDenied = 0x8006,
  kBusy = 0x8007,
  kPacketUnavailable = 0x800c,
};

// Bootstrap registers.
enum Register : std::uint32_t {
  kVersion = 0x0000,
  kDeviceMode = 0x0004,
  kMacHigh = 0x0008,
  kMacLow = 0x000c,
  kIpConfigurationOptions = 0x0010,
  kIpConfiguration = 0x0014,
  kCurrentIp = 0x0024,
  kCurrentMask = 0x0034,
  kManufacturer = 0x0048,
  kModel = 0x0068,
  kDeviceVersion = 0x0088,
  kManufacturerInfo = 0x00a8,
  kSerial = 0x00d8,
  kUserName = 0x00e8,
  kDiscoveryEnd = 0x00f8,
  kFirstUrl = 0x0200,
  kSecondUrl = 0x0400,
  kInterfaceCount = 0x0600,
  kMessageChannelCount = 0x0900,
  kStreamChannelCount = 0x0904,
  kActionSignalCount = 0x0908,
  kActionDeviceKey = 0x090c,
  kCapability = 0x0934,
  kHeartbeatTimeout = 0x0938,
  kTickFrequencyHigh = 0x093c,
  kTickFrequencyLow = 0x0940,
  kTimestampControl = 0x0944,
  kTimestampHigh = 0x0948,
  kTimestampLow = 0x094c,
  kControlPrivilege = 0x0a00,
  kPrimaryPort = 0x0a04,
  kPrimaryIp = 0x0a14,
  kStreamPort = 0x0d00,
  kStreamPacketSize = 0x0d04,
  kStreamPacketDelay = 0x0d08,
  kStreamDestination = 0x0d18,
  kStreamSourcePort = 0x0d1c,
  kActionGroupKey = 0x9800,  // of the first action signal
  kActionGroupMask = 0x9804,
};

inline constexpr std::uint32_t kExclusive = 1U << 0;
inline constexpr std::uint32_t kControl = 1U << 1;
inline constexpr std::uint32_t kFireTestPacket = 1U << 31;
inline constexpr std::uint32_t kDoNotFragment = 1U << 30;

inline void put16(std::uint8_t* at, std::uint32_t value) noexcept {
  at[0] = static_cast<std::uint8_t>(value >> 8);
  at[1] = static_cast<std::uint8_t>(value);
}
inline void put32(std::uint8_t* at, std::uint32_t value) noexcept {
  put16(at, value >> 16);
  put16(at + 2, value);
}
inline void put64(std::uint8_t* at, std::uint64_t value) noexcept {
  put32(at, static_cast<std::uint32_t>(value >> 32));
  put32(at + 4, static_cast<std::uint32_t>(value));
}
inline std::uint16_t get16(const std::uint8_t* at) noexcept {
  return static_cast<std::uint16_t>((at[0] << 8) | at[1]);
}
inline std::uint32_t get32(const std::uint8_t* at) noexcept {
  return (static_cast<std::uint32_t>(get16(at)) << 16) | get16(at + 2);
}

/// `127.0.0.1` of 0x7f000001.
std::string to_string_ip(std::uint32_t address);

/// The inverse; false where the text is no IPv4 address.
bool parse_ip(const std::string& text, std::uint32_t& address);

}  // namespace striper::detail::gvcp
