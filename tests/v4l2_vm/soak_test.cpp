// SPDX-License-Identifier: Apache-2.0
// Proves that a camera can stream for as long as it likes: no memory leaks (the source is compiled
// with AddressSanitizer here, which says so when the program ends), none that grows, and no frame
// that is missing without an explanation. 60 s; STRIPER_SOAK_SECONDS=600 makes it longer.
//
// An emulated machine on a busy host is late now and then, and so is its driver: frames that the
// driver itself counts as lost while it had empty buffers are explained. What is not is a driver
// that has none, because the source sits on them or is late to take the filled ones.
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <memory>
#include <ostream>
#include <string>

#include <gtest/gtest.h>
#include <sys/prctl.h>

#include "v4l2/v4l2_stream.hpp"
#include "v4l2_vm/calls_between.hpp"
#include "v4l2_vm/vivid.hpp"

// The sanitizer's own interface. Freed memory is kept back to find its late use: little of it, so
// that what grows can be seen.
// NOLINTBEGIN(bugprone-reserved-identifier): the names are the sanitizer's.
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() {
  return "quarantine_size_mb=1:thread_local_quarantine_size_kb=64:exitcode=23";
}
// NOLINTEND(bugprone-reserved-identifier)

namespace striper::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

// What the process has of its own: not the driver's buffers, not the libraries' code.
struct Memory {
  double in_use_MB = 0.0;    // Of the heap.
  double resident_MB = 0.0;  // Freed memory that is kept back included.

  static Memory now() {
    std::ifstream status("/proc/self/status");
    double resident_kB = 0.0;
    for (std::string word; status >> word;) {
      if (word == "RssAnon:") status >> resident_kB;
    }
    return {1e-6 * static_cast<double>(__sanitizer_get_current_allocated_bytes()),
            1e-3 * resident_kB};
  }
};

std::ostream& operator<<(std::ostream& out, const Memory& memory) {
  return out << memory.in_use_MB << " MB in use, " << memory.resident_MB << " MB resident";
}

// What is in use must not grow, but for a few numbers written down here; what is resident by what
// is kept back and how pages happen to be filled.
void expect_no_growth(const Memory& before, const Memory& after) {
  std::cout << before << "; then " << after << '\n';
  EXPECT_LT(after.in_use_MB - before.in_use_MB, 0.1);
  EXPECT_LT(after.resident_MB - before.resident_MB, 3.0);
}

seconds soak_time() {
  const char* const text = std::getenv("STRIPER_SOAK_SECONDS");
  return seconds(text != nullptr ? std::atoi(text) : 60);
}

class V4l2Soak : public ::testing::Test {
 protected:
  // The kernel gathers pages into huge ones while we look, 2 MB at a time with what nobody uses.
  static void SetUpTestSuite() { ::prctl(PR_SET_THP_DISABLE, 1, 0, 0, 0); }

  void SetUp() override {
    if (!Node(capture_path()).is_open()) GTEST_SKIP() << "there is no " << capture_path();
    const bool is_vivid = Node(capture_path()).is_vivid();
    // A busy host stops the machine for a while: no reason to open the device again.
    const std::string television = is_vivid ? "&input=0&standard=ntsc-m&format=GREY" : "";
    source_ = detail::v4l2::open(V4l2Options::from_uri(SourceUri::parse(
                                     "v4l2:" + capture_path() + "?stall_s=20" + television)),
                                 watched_);
  }

  // Reads a frame as a program does that keeps the last few, and looks at its pixels.
  void read_one() {
    Frame& frame = kept_[read_++ % kept_.size()];
    ASSERT_EQ(source_->next(frame, seconds(20)), NextStatus::kFrame);
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    for (int row = 0; row < frame.image.rows; row += 16)
      looked_at_ += frame.image.ptr(row)[row % frame.image.cols];
  }

  void read_for(steady_clock::duration time) {
    const auto until = steady_clock::now() + time;
    while (steady_clock::now() < until) ASSERT_NO_FATAL_FAILURE(read_one());
    kept_ = {};
  }

  std::shared_ptr<WatchedCalls> watched_ = std::make_shared<WatchedCalls>();
  std::unique_ptr<FrameSource> source_;
  std::array<Frame, 3> kept_;
  std::size_t read_ = 0;
  std::uint64_t looked_at_ = 0;
};

TEST_F(V4l2Soak, StreamsWithoutGrowingAndWithoutUnexplainedLoss) {
  watched_->expect(100 * static_cast<std::size_t>(soak_time().count()));
  source_->start();
  ASSERT_NO_FATAL_FAILURE(read_for(soak_time() / 5));
  const Memory before = Memory::now();
  ASSERT_NO_FATAL_FAILURE(read_for(soak_time() - soak_time() / 5));
  expect_no_growth(before, Memory::now());

  source_->stop();
  const SourceStatistics counted = source_->statistics();
  const std::size_t taken = watched_->taken().size();
  const auto period_ns = static_cast<std::int64_t>(1e9 / source_->info().picture_rate_hz);
  const std::uint64_t unexplained = watched_->lost_for_want_of_a_buffer(period_ns);
  std::cout << read_ << " frames in " << soak_time().count() << " s, " << watched_->lost()
            << " lost by the driver, " << unexplained << " of them for want of a buffer, "
            << counted.overrun << " discarded for a late reader\n";
  EXPECT_EQ(unexplained, 0U);
  EXPECT_EQ(counted.dropped, watched_->lost());
  EXPECT_EQ(counted.delivered, read_);
  EXPECT_LE(counted.delivered + counted.overrun, taken);
  EXPECT_GE(counted.delivered + counted.overrun + 4, taken) << "the queue holds four";
  EXPECT_EQ(counted.corrupt + counted.incomplete + counted.reconnects, 0U);
}

TEST_F(V4l2Soak, StartingStoppingAndReopeningDoesNotGrow) {
  constexpr int kWarmUp = 5;
  constexpr int kRounds = 15;
  const Node node(capture_path());
  watched_->expect(10'000);
  Memory before;
  for (int round = 0; round < kWarmUp + kRounds; ++round) {
    if (round == kWarmUp) before = Memory::now();
    source_->start();
    ASSERT_NO_FATAL_FAILURE(read_one());
    if (node.is_vivid() && round % 2 == 0) {
      node.press(VividControl::kFatalError);
      while (source_->statistics().reconnects == 0) ASSERT_NO_FATAL_FAILURE(read_one());
    }
    source_->stop();
    kept_ = {};
  }
  expect_no_growth(before, Memory::now());
}

}  // namespace
}  // namespace striper::testing
