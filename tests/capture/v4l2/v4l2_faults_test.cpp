// SPDX-License-Identifier: Apache-2.0
// Proves what a V4L2 source does where a driver fails: damaged frames, lost signals, refusals,
// streams that break, stall or vanish. The device is a fake; the same against the kernel's own
// driver is in tests/v4l2_vm.
#include <cerrno>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/v4l2/fake_rig.hpp"

namespace striper::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;

constexpr milliseconds kNoTime{0};

TEST(V4l2Source, FlaggedFrameIsGivenWithoutPixelsAndCounted) {
  const Rig rig;
  const auto source = rig.open_and_start();
  rig.camera->expose(V4L2_BUF_FLAG_ERROR);
  rig.camera->expose();
  const Frame damaged = next(*source);
  EXPECT_EQ(damaged.status, FrameStatus::kCorrupt);
  EXPECT_TRUE(damaged.image.empty());
  EXPECT_THAT(damaged.status_detail, HasSubstr("flagged"));
  const Frame good = next(*source);
  EXPECT_EQ(good.status, FrameStatus::kOk);
  EXPECT_EQ(good.sequence, 1U);
  EXPECT_EQ(source->statistics().corrupt, 1U);
  EXPECT_EQ(source->statistics().dropped, 0U);
}

TEST(V4l2Source, HalfFilledFrameIsIncomplete) {
  const Rig rig;
  const auto source = rig.open_and_start();
  rig.camera->expose(0, 1000);
  EXPECT_EQ(next(*source).status, FrameStatus::kIncomplete);
  EXPECT_EQ(source->statistics().incomplete, 1U);
}

TEST(V4l2Source, FramesWithoutSignalAreNotUsed) {
  const Rig rig(television(V4L2_FIELD_INTERLACED));
  const auto source = rig.open_and_start();
  const auto exposed = [&](std::int64_t stamp_ns) {
    rig.camera->set_next_time_ns(stamp_ns);
    rig.camera->expose();
    return next(*source).status;
  };
  constexpr std::int64_t kPeriod_ns = 33'366'667;
  EXPECT_EQ(exposed(now_ns()), FrameStatus::kOk);
  rig.camera->set_input_status(V4L2_IN_ST_NO_SIGNAL);
  EXPECT_EQ(exposed(now_ns()), FrameStatus::kCorrupt);
  EXPECT_EQ(exposed(now_ns()), FrameStatus::kCorrupt);
  rig.camera->set_input_status(0);
  EXPECT_EQ(exposed(now_ns()), FrameStatus::kCorrupt) << "it is of before";
  const std::int64_t back_ns = now_ns();
  EXPECT_EQ(exposed(back_ns), FrameStatus::kCorrupt) << "its first rows are of before";
  EXPECT_EQ(exposed(back_ns + kPeriod_ns + 1000), FrameStatus::kOk);
  EXPECT_EQ(source->statistics().corrupt, 4U);
}

// The capture thread came late: several frames of noise lie there when the signal is back.
TEST(V4l2Source, FramesOfNoiseThatWereLyingThereAreNotUsedAfterTheSignalIsBack) {
  const Rig rig(television(V4L2_FIELD_INTERLACED));
  const auto source = rig.open_and_start();
  rig.camera->set_input_status(V4L2_IN_ST_NO_SIGNAL);
  rig.camera->expose();
  EXPECT_EQ(next(*source).status, FrameStatus::kCorrupt);
  const std::int64_t lost_ns = now_ns();
  rig.camera->set_input_status(0);
  for (int n = 0; n < 3; ++n) {
    rig.camera->set_next_time_ns(lost_ns);
    rig.camera->expose();
    EXPECT_EQ(next(*source).status, FrameStatus::kCorrupt);
  }
}

// A grabber that streams, and whose next answers about its signal take so long.
class HesitantGrabber {
 public:
  HesitantGrabber(milliseconds delay, int answers)
      : rig_(television(V4L2_FIELD_ALTERNATE)), source_(rig_.open()) {
    rig_.camera->delay_next(VIDIOC_ENUMINPUT, delay, answers);
    source_->start();
  }
  void lose_the_signal() const { rig_.camera->set_input_status(V4L2_IN_ST_NO_SIGNAL); }
  FrameStatus exposed() const {
    rig_.camera->expose();
    return next(*source_).status;
  }

 private:
  Rig rig_;
  std::unique_ptr<FrameSource> source_;
};

// The first answer comes late because something else had the processor; the device itself is quick.
TEST(V4l2Source, OneLateAnswerAboutTheSignalLetsNoNoisePass) {
  const HesitantGrabber grabber(milliseconds(30), 1);
  EXPECT_EQ(grabber.exposed(), FrameStatus::kOk);
  grabber.lose_the_signal();
  EXPECT_EQ(grabber.exposed(), FrameStatus::kCorrupt);
}

TEST(V4l2Source, SlowGrabberIsAskedForItsSignalTenTimesASecond) {
  const HesitantGrabber grabber(milliseconds(8), 1000);
  grabber.lose_the_signal();
  const auto lost_at = steady_clock::now();
  const auto is_seen = [&] { return grabber.exposed() == FrameStatus::kCorrupt; };
  EXPECT_FALSE(is_seen()) << "it was asked just now";
  EXPECT_TRUE(eventually(is_seen));
  EXPECT_LT(steady_clock::now() - lost_at, milliseconds(1000));
}

TEST(V4l2Source, RefusalToStreamIsAnErrorAndTheNextAttemptWorks) {
  const Rig rig;
  const auto source = rig.open();
  rig.camera->fail_next(VIDIOC_STREAMON, EIO);
  EXPECT_THAT(error_of([&] { source->start(); }).what(), HasSubstr("cannot start streaming"));
  Frame frame;
  EXPECT_EQ(source->next(frame, kNoTime), NextStatus::kStopped);
  source->start();
  rig.camera->expose();
  EXPECT_EQ(next(*source).status, FrameStatus::kOk);
}

TEST(V4l2Source, RefusedBufferIsHandedBackLater) {
  Rig rig;
  rig.options.buffers = 4;
  const auto source = rig.open_and_start();
  Frame frame;
  rig.camera->expose();
  ASSERT_EQ(source->next(frame, kPatience), NextStatus::kFrame);
  rig.camera->fail_next(VIDIOC_QBUF, EINVAL);
  frame = {};
  EXPECT_EQ(rig.camera->queued(), 3);
  rig.camera->expose();
  ASSERT_EQ(source->next(frame, kPatience), NextStatus::kFrame);
  EXPECT_TRUE(eventually([&] { return rig.camera->queued() == 3; }))
      << "all but the one that the reader has";
}

TEST(V4l2Source, FailedStreamIsOpenedAgain) {
  const Rig rig;
  const auto source = rig.open_and_start();
  rig.camera->expose();
  next(*source);
  rig.camera->break_stream();
  ASSERT_TRUE(eventually([&] { return source->statistics().reconnects == 1; }));
  rig.camera->expose();
  EXPECT_EQ(next(*source).status, FrameStatus::kOk);
}

TEST(V4l2Source, UnpluggedDeviceIsWaitedForAndNumberingGoesOn) {
  FakeCamera::Setup setup = television(V4L2_FIELD_ALTERNATE);
  const Rig rig(setup);
  const auto source = rig.open_and_start();
  rig.camera->expose();
  const Frame before = next(*source);
  rig.camera->unplug();
  Frame frame;
  EXPECT_EQ(source->next(frame, milliseconds(50)), NextStatus::kTimeout);
  rig.camera->plug_in();
  ASSERT_TRUE(eventually([&] { return source->statistics().reconnects == 1; }));
  rig.camera->expose();
  const Frame after = next(*source);
  EXPECT_EQ(after.status, FrameStatus::kOk);
  EXPECT_EQ(after.field, Field::kBottom);
  EXPECT_EQ(after.exposure_in_picture, 0);
  const double passed_s =
      1e-9 * static_cast<double>(after.time.monotonic_ns - before.time.monotonic_ns);
  EXPECT_NEAR(static_cast<double>(after.sequence - before.sequence), passed_s * 30000 / 1001, 0.51);
  EXPECT_EQ(source->statistics().dropped, after.sequence - before.sequence);
}

TEST(V4l2Source, FrameInHandOutlivesTheDevice) {
  const Rig rig;
  const auto source = rig.open_and_start();
  rig.camera->expose();
  rig.camera->expose();
  next(*source);
  const Frame kept = next(*source);
  rig.camera->unplug();
  rig.camera->plug_in();
  ASSERT_TRUE(eventually([&] { return source->statistics().reconnects == 1; }));
  EXPECT_EQ(kept.image.at<std::uint8_t>(0, 0), 1);
}

TEST(V4l2Source, WithoutReconnectingTheStreamEnds) {
  Rig rig;
  rig.options.reconnect_s = 0.0;
  const auto source = rig.open_and_start();
  rig.camera->unplug();
  Frame frame;
  EXPECT_EQ(source->next(frame, kPatience), NextStatus::kEnd);
  EXPECT_EQ(source->next(frame, kPatience), NextStatus::kEnd);
}

TEST(V4l2Source, ReconnectingGivesUpAfterItsLimit) {
  Rig rig;
  rig.options.reconnect_s = 0.1;
  const auto source = rig.open_and_start();
  rig.camera->unplug();
  Frame frame;
  EXPECT_EQ(source->next(frame, kPatience), NextStatus::kEnd);
}

TEST(V4l2Source, DeviceThatComesBackDifferentIsNotUsed) {
  FakeCamera::Setup setup;
  setup.other_codes = {V4L2_PIX_FMT_YUYV};
  Rig rig(setup);
  rig.options.reconnect_s = 0.1;
  const auto source = rig.open_and_start();
  rig.camera->fail_next(VIDIOC_S_FMT, EINVAL, 1000);
  rig.camera->break_stream();
  Frame frame;
  EXPECT_EQ(source->next(frame, kPatience), NextStatus::kEnd);
  EXPECT_EQ(source->statistics().reconnects, 0U);
}

TEST(V4l2Source, StalledDeviceIsOpenedAgainAndNextTimesOutInTime) {
  Rig rig;
  rig.options.stall_s = 0.15;
  const auto source = rig.open_and_start();
  Frame frame;
  const auto asked = steady_clock::now();
  EXPECT_EQ(source->next(frame, milliseconds(50)), NextStatus::kTimeout);
  EXPECT_LT(steady_clock::now() - asked, milliseconds(500));
  EXPECT_TRUE(eventually([&] { return source->statistics().reconnects >= 1; }));
  EXPECT_EQ(rig.camera->opened(), 1 + static_cast<int>(source->statistics().reconnects));
}

TEST(V4l2Source, StopsInTimeWhileItWaitsForTheDevice) {
  const Rig rig;
  const auto source = rig.open_and_start();
  rig.camera->unplug();
  std::this_thread::sleep_for(milliseconds(100));
  const auto asked = steady_clock::now();
  source->stop();
  EXPECT_LT(steady_clock::now() - asked, milliseconds(500));
  Frame frame;
  EXPECT_EQ(source->next(frame, kNoTime), NextStatus::kStopped);
  rig.camera->plug_in();
  source->start();
  rig.camera->expose();
  EXPECT_EQ(next(*source).status, FrameStatus::kOk);
}

}  // namespace
}  // namespace striper::testing
