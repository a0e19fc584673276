// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>

#include "camera_state.hpp"

namespace striper::detail {

/// Addresses of the virtual camera's own registers, 32 bits each. The GenICam description names
/// them.
enum FeatureRegister : std::uint32_t {
  kRegSensorWidth = 0x10000,
  kRegSensorHeight = 0x10004,
  kRegWidth = 0x10008,
  kRegHeight = 0x1000c,
  kRegOffsetX = 0x10010,
  kRegOffsetY = 0x10014,
  kRegBinningHorizontal = 0x10018,
  kRegBinningVertical = 0x1001c,
  kRegPixelFormat = 0x10020,
  kRegPayloadSize = 0x10024,
  kRegExposure = 0x10030,
  kRegRate = 0x10034,
  kRegGain = 0x10038,
  kRegBlackLevel = 0x1003c,
  kRegAcquisition = 0x10040,
  kRegAcquisitionMode = 0x10044,
  kRegTriggerSelector = 0x10048,
  kRegTriggerMode = 0x1004c,
  kRegTriggerSource = 0x10050,
  kRegTriggerSoftware = 0x10054,
  kRegActionSelector = 0x10058,
  kRegLineSelector = 0x10060,
  kRegLineMode = 0x10064,
  kRegLineSource = 0x10068,
  kRegLineStatusAll = 0x1006c,
  kRegUserOutputSelector = 0x10070,
  kRegUserOutputValue = 0x10074,
  kRegSequencerMode = 0x10080,
  kRegSequencerConfiguration = 0x10084,
  kRegSequencerSet = 0x10088,
  kRegSequencerSave = 0x1008c,
  kRegSequencerPath = 0x10090,
  kRegSequencerNext = 0x10094,
  kRegSequencerStart = 0x10098,
  kRegChunkMode = 0x100a0,
  kRegChunkSelector = 0x100a4,
  kRegChunkEnable = 0x100a8,
  kRegLostPackets = 0x100b0,
  kRegPtpEnable = 0x100c0,
  kRegPtpLatch = 0x100c4,
  kRegPtpStatus = 0x100c8,
  kRegIeee1588Status = 0x100cc,
};

inline constexpr std::uint32_t kXmlAddress = 0x100000;
inline constexpr std::uint32_t kImageChunk = 0x00000001;
inline constexpr std::uint32_t kLineChunk = 0x00000011;
inline constexpr std::uint32_t kEncoderChunk = 0x00000012;

/// A register's behaviour. An absent `set` is read-only; `set` answers false to a value that it
/// does not take.
struct RegisterHooks {
  std::function<std::uint32_t()> get;
  std::function<bool(std::uint32_t)> set;
};

/// What registers do beyond remembering.
struct RegisterActions {
  std::function<void(bool is_acquiring)> acquire;
  std::function<void(TriggerSource)> trigger;
  std::function<std::uint32_t()> lost_ppm;
  std::function<void(std::uint32_t)> set_lost_ppm;
};

/// Bytes of one frame on the wire, chunks included.
std::uint32_t payload_bytes(const CameraState& state);

/// The camera's registers over its state. The state must outlive them.
std::map<std::uint32_t, RegisterHooks> feature_registers(CameraState& state,
                                                         const RegisterActions& actions);

}  // namespace striper::detail
