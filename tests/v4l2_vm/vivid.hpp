// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <linux/videodev2.h>

namespace striper::testing {

// The kernel's virtual video driver, as tests/v4l2_vm/run_in_vm.sh loads it.

/// Controls of vivid that tests use (drivers/media/test-drivers/vivid/vivid-ctrls.c).
enum class VividControl : std::uint32_t {
  kPattern = 0x00f0f000,
  kOsdText = 0x00f0f001,
  kTimestampSource = 0x00f0f018,
  kLoopVideo = 0x00f0f025,
  kWrapSequence = 0x00f0f026,
  kSignalMode = 0x00f0f03c,
  kDroppedPercent = 0x00f0f040,
  kDisconnect = 0x00f0f041,
  kFlagError = 0x00f0f042,
  kRequestError = 0x00f0f043,
  kQueueError = 0x00f0f044,
  kStreamOnError = 0x00f0f045,
  kFatalError = 0x00f0f046,
};

enum class SignalMode { kGood = 0, kNone = 1, kUnlocked = 2 };

/// An open node for asking and telling the driver things beside the source under test.
class Node {
 public:
  explicit Node(const std::string& path);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  ~Node();

  bool is_open() const noexcept { return fd_ >= 0; }
  bool is_vivid() const;
  int call(unsigned long request, void* argument) const noexcept;
  std::uint8_t* map(std::size_t bytes, std::int64_t offset) const;
  void set(VividControl control, int value) const;
  void press(VividControl control) const { set(control, 1); }

 private:
  int fd_;
};

/// What the output node is to send.
struct Broadcast {
  v4l2_std_id standard = V4L2_STD_NTSC_M;
  std::uint32_t code = V4L2_PIX_FMT_GREY;
  std::uint32_t field = V4L2_FIELD_INTERLACED;
  int width = 720;
  int height = 480;  ///< Of the whole image.
};

/// Sends frames on the output node, whose signal arrives at the looped input bit for bit, over
/// and over, until it is destroyed. A frame lasts until the next one: the two nodes are not in
/// step, so an input frame may come twice or not at all.
class Transmitter {
 public:
  /// @param frames in the driver's layout: one whole buffer each; for `alternate` one field each,
  /// in the order of the fields.
  Transmitter(const std::string& path, const Broadcast& broadcast,
              std::vector<std::vector<std::uint8_t>> frames);
  Transmitter(const Transmitter&) = delete;
  Transmitter& operator=(const Transmitter&) = delete;
  ~Transmitter();

  /// Sends these from now on; as many and of the same size as before.
  void change(std::vector<std::vector<std::uint8_t>> frames);

  /// When it last had to begin anew, on CLOCK_MONOTONIC: about then the driver sends its own test
  /// pattern. 0: it has not.
  std::int64_t began_anew_ns() const noexcept { return began_anew_ns_; }

  std::size_t buffer_bytes() const noexcept { return buffer_bytes_; }
  std::size_t stride() const noexcept { return stride_; }

 private:
  void configure(const Broadcast& broadcast);
  int start();
  void fill_and_queue(std::uint32_t index);
  void run();

  Node node_;
  std::uint32_t field_;
  bool bottom_first_;  ///< The first of two alternate fields.
  std::mutex mutex_;   ///< Guards the frames.
  std::vector<std::vector<std::uint8_t>> frames_;
  struct Buffer {
    std::uint8_t* memory = nullptr;
    const std::uint8_t* holds = nullptr;  ///< Which frame was copied into it.
  };
  std::vector<Buffer> buffers_;
  std::size_t buffer_bytes_ = 0;
  std::size_t stride_ = 0;
  std::size_t next_ = 0;
  std::atomic<bool> is_stopping_{false};
  std::atomic<std::int64_t> began_anew_ns_{0};
  std::thread thread_;
};

/// The capture node that tests are to use: STRIPER_VIDEO_DEVICE or /dev/video0.
std::string capture_path();

/// The output node looped to it; only the virtual driver has one.
std::string output_path();

}  // namespace striper::testing
