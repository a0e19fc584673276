// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <netinet/in.h>

#include <striper/virtual_camera/virtual_camera.hpp>

#include "camera_faults.hpp"
#include "camera_state.hpp"
#include "feature_registers.hpp"
#include "gige/protocol/gvcp.hpp"
#include "live/host_clock.hpp"
#include "register_log.hpp"
#include "stream_sender.hpp"

namespace striper::detail {

inline constexpr std::size_t kBootstrapBytes = 0x1000;
inline constexpr std::uint32_t kLoopbackMask = 0xff000000;
inline constexpr std::uint32_t kLoopback = 0x7f000000;

/// The virtual camera itself: one thread answers the control protocol, one takes and sends
/// frames.
class Device {
 public:
  Device(std::shared_ptr<VirtualScene> scene, VirtualCameraOptions options,
         CameraFaults faults = {});
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device();

  VirtualCameraStatistics statistics() const;
  std::vector<RegisterWrite> register_writes() const;

  // Faults that tests switch on and off.
  void set_silent(bool is_silent);  ///< Answers nothing, sends nothing: a pulled plug.
  /// Answers and sends no frames: a firewall.
  void set_stream_blocked(bool is_blocked) { sender_.is_silent = is_blocked; }
  void set_stuck(std::set<std::string> features);  ///< As CameraFaults::stuck.
  void forget_controller();                        ///< As after a reset: nobody is in control.

 private:
  struct Client {
    std::uint32_t address = 0;
    std::uint16_t port = 0;
    friend bool operator==(const Client&, const Client&) = default;
  };
  /// What the shutter sees, decided when it opens.
  struct Exposure {
    std::uint64_t number = 0;
    std::uint16_t block_id = 0;
    std::int64_t begin_ns = 0;
    Illumination light;
    std::uint32_t line_status = 0;
    CameraState state;
    std::size_t packet_bytes = 0;
    std::int64_t packet_delay_ns = 0;
    sockaddr_in to{};
  };
  using Answer = std::vector<std::uint8_t>;

  // Making (device.cpp).
  void open_sockets();
  void fill_bootstrap();
  void put_text(std::uint32_t address, const std::string& text, std::size_t size);
  void put_word(std::uint32_t address, std::uint32_t value);
  std::uint32_t word(std::uint32_t address) const;

  // Control protocol (device_control.cpp).
  void run_control();
  void answer_packets(int fd);
  void answer(std::span<const std::uint8_t> request, const sockaddr_in& from);
  std::uint16_t execute(std::uint16_t command, std::span<const std::uint8_t> data,
                        const Client& client, Answer& result);
  std::uint16_t read_registers(std::span<const std::uint8_t> data, Answer& result);
  std::uint16_t write_registers(std::span<const std::uint8_t> data, const Client& client,
                                Answer& result);
  std::uint16_t read_memory(std::span<const std::uint8_t> data, Answer& result);
  std::uint16_t write_memory(std::span<const std::uint8_t> data, const Client& client,
                             Answer& result);
  std::uint16_t resend(std::span<const std::uint8_t> data);
  std::uint16_t act(std::span<const std::uint8_t> data);
  std::uint16_t read_word(std::uint32_t address, std::uint32_t& value);
  std::uint16_t write_word(std::uint32_t address, std::uint32_t value, const Client& client);
  std::uint16_t write_privilege(std::uint32_t value, const Client& client);
  std::uint16_t write_packet_size(std::uint32_t value);
  std::uint16_t write_feature(std::uint32_t address, std::uint32_t value);
  std::uint16_t write_bootstrap(std::uint32_t address, std::uint32_t value);
  void latch_timestamp();
  void drop_control();
  sockaddr_in stream_destination() const;

  // Frames (device_stream.cpp).
  void acquire(bool is_acquiring);
  void trigger(TriggerSource source);
  void run_stream();
  bool wait_for_exposure(std::unique_lock<std::mutex>& lock);
  std::int64_t begin_exposure_ns();
  Exposure open_shutter();
  Illumination light_of(const Exposure& exposure) const;
  void take_and_send(const Exposure& exposure);
  void fill_payload(const Exposure& exposure, const cv::Mat& sensor, SentFrame& frame);
  std::uint32_t encoder_counts(std::int64_t time_ns) const noexcept;
  std::int64_t device_time_ns(const CameraState& state, std::int64_t host_ns) const;

  std::shared_ptr<VirtualScene> scene_;
  VirtualCameraOptions options_;
  CameraFaults faults_;
  std::uint32_t address_ = 0;
  std::string xml_;
  StreamSender sender_;
  RegisterLog log_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  CameraState state_;
  std::map<std::uint32_t, RegisterHooks> features_;
  std::vector<std::uint8_t> bootstrap_;
  Client controller_;
  bool is_controlled_ = false;
  std::int64_t heard_at_ns_ = 0;
  std::uint64_t controllers_ = 0;

  std::uint64_t triggers_ = 0;
  std::uint64_t next_number_ = 0;
  std::uint32_t sequencer_at_ = 0;
  std::int64_t due_ns_ = 0;
  const std::int64_t born_ns_ = monotonic_now_ns();
  std::uint64_t frames_ = 0;

  int control_fd_ = -1;
  int broadcast_fd_ = -1;
  std::atomic<bool> is_ending_ = false;
  std::atomic<bool> is_silent_ = false;
  std::thread control_thread_;
  std::thread stream_thread_;
};

}  // namespace striper::detail
