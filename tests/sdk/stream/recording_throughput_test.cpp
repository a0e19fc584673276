// SPDX-License-Identifier: Apache-2.0
// Proves that frames of a live camera are recorded as fast as they come: 2048x1088 at 60/s for 10
// s, 640x480 at 200/s for 60 s, nothing lost that the disk takes, in memory that does not grow.
// Prints the processor time beside that of dd writing the same bytes. How fast a disk is it does
// not prove.
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <fstream>
#include <mutex>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include <striper/stream/mcap_recording.hpp>
#include <striper/stream/recording_info.hpp>

#include "support/random.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using Clock = std::chrono::steady_clock;

double processor_s(int who) {
  rusage used{};
  ::getrusage(who, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double all = 0.0;
  double resident = 0.0;
  file >> all >> resident;
  return 1e-6 * resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

/// A camera as drivers have it: a few buffers; what comes while all are full is lost, and counted.
class Camera {
 public:
  Camera(cv::Size size, double rate_hz, int frames) : rate_hz_(rate_hz), frames_(frames) {
    testing::reseed();
    for (int i = 0; i < 8; ++i) {  // An uneven background with noise of 2 DN.
      cv::Mat image(size, CV_8UC1);
      cv::randn(image, 60, 2);
      for (int u = 0; u < size.width; ++u) {
        const int v = size.height / 2 + (u + 10 * i) % 50;
        for (int k = -2; k <= 2; ++k)
          image.at<std::uint8_t>(v + k, u) = static_cast<std::uint8_t>(220 - 40 * std::abs(k));
      }
      images_.push_back(image);
    }
    thread_ = std::thread([this] { expose(); });
  }
  ~Camera() { thread_.join(); }

  bool next(Frame& frame) {
    std::unique_lock lock(mutex_);
    has_any_.wait(lock, [this] { return !full_.empty() || is_over_; });
    if (full_.empty()) return false;
    frame = full_.front();
    full_.pop_front();
    return true;
  }

  int lost() const { return lost_; }

 private:
  void expose() {
    const auto start = Clock::now();
    for (int number = 0; number < frames_; ++number) {
      std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(
                                                std::chrono::duration<double>(number / rate_hz_)));
      const std::lock_guard lock(mutex_);
      if (full_.size() == kBuffers) {
        ++lost_;
        continue;
      }
      Frame frame;
      frame.image = images_[static_cast<std::size_t>(number) % images_.size()];
      frame.sequence = static_cast<std::uint64_t>(number);
      frame.time.monotonic_ns = static_cast<std::int64_t>(1e9 * number / rate_hz_);
      frame.sensor_size = frame.image.size();
      full_.push_back(frame);
      has_any_.notify_one();
    }
    const std::lock_guard lock(mutex_);
    is_over_ = true;
    has_any_.notify_one();
  }

  static constexpr std::size_t kBuffers = 16;
  double rate_hz_;
  int frames_;
  std::vector<cv::Mat> images_;
  std::mutex mutex_;
  std::condition_variable has_any_;
  std::deque<Frame> full_;
  bool is_over_ = false;
  int lost_ = 0;
  std::thread thread_;
};

struct Load {
  const char* name;
  cv::Size size;
  double rate_hz;
  int frames;
};

class RecordingThroughput : public ::testing::TestWithParam<Load> {};

TEST_P(RecordingThroughput, NothingIsLostAndMemoryDoesNotGrow) {
  const Load& load = GetParam();
  const testing::ScratchDirectory scratch;
  const auto path = scratch / "run.mcap";
  McapRecording recording(path);
  SourceInfo source;
  source.is_live = true;
  recording.open(head_info("striper", source, nullptr, StripeAxis::kColumns));

  double early_mb = 0.0;
  double late_mb = 0.0;
  int written = 0;
  double slowest_s = 0.0;
  const double before_s = processor_s(RUSAGE_SELF);
  Camera camera(load.size, load.rate_hz, load.frames);
  for (Frame frame; camera.next(frame); ++written) {
    const auto start = Clock::now();
    recording.write(frame);
    slowest_s = std::max(slowest_s, std::chrono::duration<double>(Clock::now() - start).count());
    if (written == load.frames / 5) early_mb = resident_mb();
    late_mb = resident_mb();
  }
  recording.close();
  const double own_s = processor_s(RUSAGE_SELF) - before_s;

  const double bytes = static_cast<double>(load.size.area()) * written;
  const double of_dd_before_s = processor_s(RUSAGE_CHILDREN);
  const std::string dd =
      fmt::format("dd if=/dev/zero of={} bs=1M count={} 2>/dev/null", (scratch / "dd").string(),
                  static_cast<int>(bytes / 1048576.0));
  ASSERT_EQ(std::system(dd.c_str()), 0);
  const double dd_s = processor_s(RUSAGE_CHILDREN) - of_dd_before_s;

  std::printf(
      "%s: %d frames, %d lost, %.0f MB in %.0f MB; processor %.2f s, dd %.2f s, %.1f times; "
      "slowest write %.0f ms; "
      "resident %.1f to %.1f MB\n",
      load.name, written, camera.lost(), 1e-6 * bytes,
      1e-6 * static_cast<double>(std::filesystem::file_size(path)), own_s, dd_s, own_s / dd_s,
      1e3 * slowest_s, early_mb, late_mb);
  EXPECT_EQ(camera.lost(), 0);
  EXPECT_EQ(inspect_recording(path).frames, static_cast<std::uint64_t>(written));
  EXPECT_LT(late_mb - early_mb, 4.0);
}

INSTANTIATE_TEST_SUITE_P(Loads, RecordingThroughput,
                         ::testing::Values(Load{"2048x1088 at 60/s", {2048, 1088}, 60.0, 600},
                                           Load{"640x480 at 200/s", {640, 480}, 200.0, 12000}),
                         [](const auto& load) {
                           return fmt::format("w{}", load.param.size.width);
                         });

}  // namespace
}  // namespace striper
