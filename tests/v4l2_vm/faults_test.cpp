// SPDX-License-Identifier: Apache-2.0
// Proves on the kernel's own driver, whose controls make faults on demand, that each is counted
// right, that nothing hangs for 2 s and that the stream goes on when the device does.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/v4l2/v4l2_source.hpp>

#include "support/error_of.hpp"
#include "v4l2/v4l2_stream.hpp"
#include "v4l2_vm/calls_between.hpp"
#include "v4l2_vm/vivid.hpp"

namespace striper::testing {
namespace {

using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;

constexpr milliseconds kLongest{2000};
constexpr double kRate_hz = 30000.0 / 1001.0;

class VividFaults : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!Node(capture_path()).is_vivid())
      GTEST_SKIP() << "only the kernel's virtual driver makes faults on demand";
    Node(capture_path()).set(VividControl::kDroppedPercent, 0);
    Node(capture_path()).set(VividControl::kSignalMode, 0);
  }
  void TearDown() override {
    const Node node(capture_path());
    if (!node.is_vivid()) return;
    node.set(VividControl::kDroppedPercent, 0);
    node.set(VividControl::kSignalMode, 0);
    node.set(VividControl::kWrapSequence, 0);
    node.set(VividControl::kTimestampSource, 0);
  }

  static std::unique_ptr<FrameSource> open(const std::string& query = "") {
    return open_source("v4l2:" + capture_path() + "?input=0&standard=ntsc-m&format=GREY" + query);
  }

  // The same with somebody who writes down what the kernel hands over.
  static std::unique_ptr<FrameSource> open(const std::shared_ptr<WatchedCalls>& watched) {
    return detail::v4l2::open(
        V4l2Options::from_uri(
            SourceUri::parse("v4l2:" + capture_path() + "?input=0&standard=ntsc-m&format=GREY")),
        watched);
  }

  // The next frame, which must come or time out within 2 s.
  static std::optional<Frame> next(FrameSource& source, milliseconds timeout = kLongest) {
    Frame frame;
    const auto asked = steady_clock::now();
    const NextStatus status = source.next(frame, timeout);
    EXPECT_LT(steady_clock::now() - asked, timeout + milliseconds(500)) << "hangs";
    if (status != NextStatus::kFrame) return std::nullopt;
    return frame;
  }

  static void expect_goes_on(FrameSource& source) {
    for (int frame = 0; frame < 5; ++frame) {
      const auto got = next(source);
      ASSERT_TRUE(got.has_value());
      EXPECT_EQ(got->status, FrameStatus::kOk) << got->status_detail;
    }
  }
};

std::string refusal(const std::function<void()>& action) { return error_of(action).what(); }

struct Losses {
  std::uint64_t frames = 0;  // With the lost ones.
  std::uint64_t lost = 0;
  double share() const { return static_cast<double>(lost) / static_cast<double>(frames); }
};

TEST_F(VividFaults, DroppedBuffersAreCountedOneByOne) {
  const auto watched = std::make_shared<WatchedCalls>();
  const auto source = open(watched);
  const auto stream_for = [&](seconds time) {
    source->start();
    std::uint64_t delivered = 0;
    std::optional<std::uint64_t> first;
    const auto until = steady_clock::now() + time;
    while (steady_clock::now() < until) {
      const auto frame = next(*source);
      if (!frame) break;
      if (!first) first = frame->sequence - delivered;
      ++delivered;
    }
    source->stop();
    const std::uint64_t taken = watched->taken().size();
    EXPECT_EQ(source->statistics().dropped, watched->lost()) << "by the kernel's own numbers";
    EXPECT_EQ(source->statistics().delivered, delivered);
    // What was taken and not delivered was discarded for a late reader, or lay there at the end.
    EXPECT_LE(delivered + source->statistics().overrun, taken);
    EXPECT_GE(delivered + source->statistics().overrun + 4, taken);
    return Losses{taken + watched->lost(), watched->lost()};
  };
  const Losses by_itself = stream_for(seconds(2));  // An emulated machine may be late.
  Node(capture_path()).set(VividControl::kDroppedPercent, 20);
  const Losses injected = stream_for(seconds(6));
  // Binomial: a fifth, 4 standard deviations either way.
  const double sigma = std::sqrt(0.2 * 0.8 / static_cast<double>(injected.frames));
  EXPECT_GT(injected.share(), 0.2 - 4.0 * sigma);
  EXPECT_LT(injected.share(), 0.2 + 4.0 * sigma + 2.0 * by_itself.share());
}

TEST_F(VividFaults, FramesFlaggedOnceASecondAreCountedAndHaveNoPixels) {
  constexpr int kSeconds = 5;
  const auto watched = std::make_shared<WatchedCalls>();
  const auto source = open(watched);
  source->start();
  const Node node(capture_path());
  const auto began = steady_clock::now();
  std::uint64_t corrupt = 0;
  for (int pressed = 0; pressed < kSeconds;) {
    if (steady_clock::now() >= began + seconds(pressed)) {
      node.press(VividControl::kFlagError);
      ++pressed;
    }
    for (int frame = 0; frame < 8; ++frame) {  // At least so many until the next time.
      const auto got = next(*source);
      ASSERT_TRUE(got.has_value());
      if (got->status == FrameStatus::kOk) continue;
      EXPECT_EQ(got->status, FrameStatus::kCorrupt);
      EXPECT_TRUE(got->image.empty());
      ++corrupt;
    }
  }
  const std::uint64_t flagged = watched->flagged();
  EXPECT_EQ(flagged, static_cast<std::uint64_t>(kSeconds)) << "as often as it was asked for";
  EXPECT_LE(corrupt, flagged);
  EXPECT_GE(corrupt + source->statistics().overrun, flagged)
      << "delivered as such, unless a late reader made it give way";
  EXPECT_EQ(source->statistics().corrupt, corrupt);
  EXPECT_EQ(source->statistics().reconnects, 0U);
}

TEST_F(VividFaults, RefusalToStreamIsSaidAndTheNextAttemptWorks) {
  const auto source = open();
  Node(capture_path()).press(VividControl::kStreamOnError);
  EXPECT_THAT(refusal([&] { source->start(); }), HasSubstr("cannot start streaming"));
  source->start();
  expect_goes_on(*source);
}

TEST_F(VividFaults, RefusalOfBuffersIsSaidAndTheNextAttemptWorks) {
  const auto source = open();
  Node(capture_path()).press(VividControl::kRequestError);
  EXPECT_THAT(refusal([&] { source->start(); }), HasSubstr("buffers"));
  source->start();
  expect_goes_on(*source);
}

TEST_F(VividFaults, RefusedBuffersAreHandedBackLaterAndNoneIsLost) {
  constexpr int kRefusals = 15;  // More than there are buffers.
  const auto watched = std::make_shared<WatchedCalls>();
  const auto source = open(watched);
  source->start();
  const Node node(capture_path());
  for (int refused = 0; refused < kRefusals; ++refused) {
    node.press(VividControl::kQueueError);
    for (int frame = 0; frame < 20 && watched->refused_buffers() <= refused; ++frame)
      ASSERT_TRUE(next(*source).has_value()) << "after " << refused << " refusals";
  }
  EXPECT_EQ(watched->refused_buffers(), kRefusals);
  expect_goes_on(*source);
  EXPECT_GE(watched->taken().back().left_with_driver, V4l2Options().buffers - 6)
      << "all but the queue's four, the one that the reader has and this one";
  EXPECT_EQ(source->statistics().reconnects, 0U);
}

TEST_F(VividFaults, FatalErrorIsRecoveredFrom) {
  const auto source = open();
  source->start();
  const auto before = next(*source);
  ASSERT_TRUE(before.has_value());
  Node(capture_path()).press(VividControl::kFatalError);
  const auto pressed = steady_clock::now();
  while (source->statistics().reconnects == 0 && steady_clock::now() < pressed + kLongest)
    next(*source, milliseconds(100));
  EXPECT_EQ(source->statistics().reconnects, 1U);
  expect_goes_on(*source);
}

TEST_F(VividFaults, UnpluggedDeviceIsWaitedForAndNumbersGoOnWithTheTime) {
  const auto source = open("&field=alternate");
  source->start();
  std::optional<Frame> before;
  for (int frame = 0; frame < 6; ++frame) before = next(*source);
  ASSERT_TRUE(before.has_value());
  // Mapped memory keeps the old device open, and this driver plugs itself in when all have closed
  // it.
  before->image.release();
  before->lease.reset();
  {
    const Node hand(capture_path());  // As long as somebody has it open it stays unplugged.
    hand.press(VividControl::kDisconnect);
    const auto until = steady_clock::now() + milliseconds(1200);
    while (steady_clock::now() < until) next(*source, milliseconds(100));
    EXPECT_EQ(source->statistics().reconnects, 0U);
  }
  const auto plugged_in = steady_clock::now();
  std::optional<Frame> after;
  while (!after && steady_clock::now() < plugged_in + kLongest)
    after = next(*source, milliseconds(100));
  ASSERT_TRUE(after.has_value());
  EXPECT_EQ(source->statistics().reconnects, 1U);
  const double passed_s =
      1e-9 * static_cast<double>(after->time.monotonic_ns - before->time.monotonic_ns);
  EXPECT_GT(passed_s, 1.0);
  EXPECT_NEAR(static_cast<double>(after->exposure_number() - before->exposure_number()),
              passed_s * 2.0 * kRate_hz, 1.01);
  const bool is_bottom = after->field == Field::kBottom;
  EXPECT_EQ(after->exposure_in_picture, is_bottom ? 0 : 1) << "parity";
  expect_goes_on(*source);
}

TEST_F(VividFaults, LostSignalIsFlaggedAndComesBack) {
  const auto source = open();
  source->start();
  expect_goes_on(*source);
  const Node node(capture_path());
  std::uint64_t corrupt = 0;
  const auto read_until = [&](FrameStatus status) {
    constexpr int kOnTheirWay = 6;  // What the queue holds.
    for (int frame = 0; frame < kOnTheirWay; ++frame) {
      const auto got = next(*source);
      ASSERT_TRUE(got.has_value());
      if (got->status == FrameStatus::kCorrupt) ++corrupt;
      if (got->status == status) return;
    }
    FAIL() << "the signal's state is not seen";
  };
  for (const SignalMode mode : {SignalMode::kNone, SignalMode::kUnlocked}) {
    node.set(VividControl::kSignalMode, static_cast<int>(mode));
    ASSERT_NO_FATAL_FAILURE(read_until(FrameStatus::kCorrupt));
    for (int frame = 0; frame < 5; ++frame) {
      const auto got = next(*source);
      ASSERT_TRUE(got.has_value());
      EXPECT_EQ(got->status, FrameStatus::kCorrupt);
      EXPECT_THAT(got->status_detail, HasSubstr("signal"));
      ++corrupt;
    }
    node.set(VividControl::kSignalMode, static_cast<int>(SignalMode::kGood));
    ASSERT_NO_FATAL_FAILURE(read_until(FrameStatus::kOk));
    expect_goes_on(*source);
  }
  EXPECT_EQ(source->statistics().corrupt, corrupt);
  EXPECT_EQ(source->statistics().reconnects, 0U);
}

TEST_F(VividFaults, InputWithoutSignalOrLockIsRefusedEachWithItsMessage) {
  const Node node(capture_path());
  int input = 0;
  node.call(VIDIOC_S_INPUT, &input);
  node.set(VividControl::kSignalMode, static_cast<int>(SignalMode::kNone));
  EXPECT_THAT(refusal([] { open(); }), HasSubstr("has no signal"));
  node.set(VividControl::kSignalMode, static_cast<int>(SignalMode::kUnlocked));
  EXPECT_THAT(refusal([] { open(); }), HasSubstr("cannot lock"));
  EXPECT_NO_THROW(open("&signal=ignore"));
}

TEST_F(VividFaults, NumberingSurvivesTheDriversWrapAround) {
  Node(capture_path()).set(VividControl::kWrapSequence, 1);  // It begins 128 before the end.
  const auto source = open("&field=alternate");
  source->start();
  std::optional<Frame> last;
  for (int frame = 0; frame < 300; ++frame) {
    const auto got = next(*source);
    ASSERT_TRUE(got.has_value());
    if (last) {
      ASSERT_GT(got->exposure_number(), last->exposure_number());
      ASSERT_LT(got->exposure_number(), last->exposure_number() + 20) << "frame " << frame;
    }
    last = got;
  }
}

TEST_F(VividFaults, StampOfTheStartOfExposureIsUsedAsSuch) {
  double age_s[2] = {};
  for (const int source_of_stamp : {0, 1}) {
    Node(capture_path()).set(VividControl::kTimestampSource, source_of_stamp);
    const auto source = open();
    source->start();
    double youngest_s = 1.0;
    for (int frame = 0; frame < 10; ++frame) {
      const auto got = next(*source);
      ASSERT_TRUE(got.has_value());
      const auto now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                              steady_clock::now().time_since_epoch())
                              .count();
      youngest_s =
          std::min(youngest_s, 1e-9 * static_cast<double>(now_ns - got->time.monotonic_ns));
    }
    age_s[source_of_stamp] = youngest_s;
  }
  // The driver puts the end of a frame 0.9 periods after its start. Taken for what they are, the
  // two kinds of stamp mean the same moment to 0.1 periods; taken for one another they are 1 period
  // off.
  EXPECT_NEAR(age_s[0] - age_s[1], 0.1 / kRate_hz, 0.2 / kRate_hz);
}

}  // namespace
}  // namespace striper::testing
