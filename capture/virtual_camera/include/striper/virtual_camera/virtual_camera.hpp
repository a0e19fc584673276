// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <striper/virtual_camera/virtual_scene.hpp>

namespace striper {

/// How the virtual camera is, and the cable that it sends through.
struct VirtualCameraOptions {
  std::string address = "127.0.0.1";  ///< Any address of 127.0.0.0/8; one camera each.
  std::string serial = "STRIPER1";
  std::string user_name;

  double lost_packets = 0.0;  ///< Fraction of the stream's packets that never arrive.
  bool can_resend = true;
  int mtu = 16000;              ///< Larger packets do not get through.
  double link_mbit_s = 1000.0;  ///< A frame is spread over the time that this link would take.
  double clock_skew = 0.0;      ///< Device seconds per second, minus one.
  double encoder_counts_per_s = 1000.0;  ///< Of its encoder, whose counts a chunk can bring.

  /// @throws Error{kBadValue} quoting field, value and bound.
  void validate() const;
};

/// What the virtual camera did; counts since it was made.
struct VirtualCameraStatistics {
  std::uint64_t frames = 0;
  std::uint64_t packets = 0;
  std::uint64_t lost = 0;
  std::uint64_t resent = 0;
  std::uint64_t controllers = 0;  ///< How many clients took control.
  bool is_controlled = false;
  bool is_streaming = false;
  bool is_laser_armed = false;  ///< A line would fire a laser at the next exposure.
};

/// A register that a client set.
struct RegisterWrite {
  std::int64_t time_ns = 0;      ///< CLOCK_MONOTONIC.
  std::uint64_t controller = 0;  ///< The first client that took control is 1.
  std::string name;              ///< Of the GenICam feature, or the address.
  std::uint32_t value = 0;       ///< As the register holds it.
  bool is_laser_armed = false;   ///< Whether a line would fire a laser now.
};

/// Serves a scene as a GigE Vision 1.2 camera on this machine: discovery, registers, GenICam
/// description, stream with resend, chunk data, software trigger, output lines and sequencer. Any
/// GigE Vision client can use it.
///
/// Line2 fires laser 0 and Line3 laser 1, during the exposure where LineSource is ExposureActive
/// and for as long as it is set where it is UserOutput. Until a client sets one of them the scene's
/// lasers fire by themselves in the scene's own pattern. Lines go off when the client's control is
/// lost.
///
/// Frame n after acquisition start shows the scene's image n. Threads: two of its own; all
/// functions may be called from any thread. It answers on 127.0.0.0/8 only and never to another
/// machine.
class VirtualCamera {
 public:
  /// Begins to answer. @throws Error{kDevice} if another camera has the address,
  /// Error{kBadValue} as `validate`.
  VirtualCamera(std::shared_ptr<VirtualScene> scene, VirtualCameraOptions options);
  ~VirtualCamera();

  VirtualCameraStatistics statistics() const;

  /// What clients set, in order; the last 16384 writes that were taken.
  std::vector<RegisterWrite> register_writes() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
