// SPDX-License-Identifier: Apache-2.0
// Proves what frames a V4L2 source makes of a driver's buffers: pixels, fields, numbers, times, and
// which of them a late reader gets. The device is a fake; the same against the kernel's own
// driver is in tests/v4l2_vm.
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "capture/v4l2/fake_rig.hpp"

namespace striper::testing {
namespace {

using ::testing::HasSubstr;

// --- Fields, numbers and times ---

TEST(V4l2Source, GreyImagesAreGivenInTheDriversOwnMemory) {
  const Rig rig;
  const auto source = rig.open_and_start();
  rig.camera->expose();
  const Frame frame = next(*source);
  EXPECT_NE(frame.lease, nullptr);
  EXPECT_EQ(frame.image.u, nullptr) << "not allocated";
  EXPECT_EQ(frame.image.at<std::uint8_t>(3, 3), 0);
}

TEST(V4l2Source, DeepGreyOfPaddedRowsIsGivenInPlaceToo) {
  FakeCamera::Setup setup;
  setup.code = V4L2_PIX_FMT_Y12;
  setup.padding = 32;
  const Rig rig(setup);
  const auto source = rig.open_and_start();
  rig.camera->set_pixels([](std::uint8_t* data, std::size_t bytes, std::uint64_t) {
    for (std::size_t at = 0; at < bytes; ++at) data[at] = at % 2 == 0 ? 0xCD : 0x0A;
  });
  rig.camera->expose();
  const Frame frame = next(*source);
  EXPECT_EQ(frame.image.type(), CV_16UC1);
  EXPECT_EQ(frame.bit_depth, 12);
  EXPECT_EQ(frame.image.step[0], 64U * 2 + 32);
  EXPECT_EQ(cv::countNonZero(frame.image != 0x0ACD), 0);
}

TEST(V4l2Source, NtscBeginsWithTheBottomFieldAndPalWithTheTop) {
  for (const auto& [standard, field] : {std::pair(V4L2_STD_NTSC_M, Field::kInterlacedBottomFirst),
                                        std::pair(V4L2_STD_PAL_BG, Field::kInterlacedTopFirst)}) {
    const Rig rig(television(V4L2_FIELD_INTERLACED, standard));
    const auto source = rig.open_and_start();
    rig.camera->expose();
    EXPECT_EQ(next(*source).field, field);
    EXPECT_EQ(source->info().field, field);
  }
}

TEST(V4l2Source, ExplicitFieldOrderWinsOverTheStandard) {
  const Rig rig(television(V4L2_FIELD_INTERLACED_TB));
  EXPECT_EQ(rig.open()->info().field, Field::kInterlacedTopFirst);
}

TEST(V4l2Source, FieldsKeyOverridesTheDriver) {
  Rig rig(television(V4L2_FIELD_INTERLACED));
  rig.options.fields = Field::kInterlacedTopFirst;
  const auto source = rig.open_and_start();
  rig.camera->expose();
  EXPECT_EQ(next(*source).field, Field::kInterlacedTopFirst);
}

TEST(V4l2Source, SequentialFieldsAreTwoFramesOverOneBuffer) {
  const Rig rig(television(V4L2_FIELD_SEQ_BT));
  const auto source = rig.open_and_start();
  rig.camera->set_pixels([](std::uint8_t* data, std::size_t bytes, std::uint64_t) {
    std::memset(data, 11, bytes / 2);
    std::memset(data + bytes / 2, 22, bytes / 2);
  });
  rig.camera->expose();
  const Frame first = next(*source);
  const Frame second = next(*source);
  EXPECT_EQ(first.field, Field::kBottom);
  EXPECT_EQ(second.field, Field::kTop);
  EXPECT_EQ(first.image.at<std::uint8_t>(23, 63), 11);
  EXPECT_EQ(second.image.at<std::uint8_t>(0, 0), 22);
  EXPECT_EQ(first.image.rows, 24);
  EXPECT_EQ(first.lease, second.lease);
  EXPECT_EQ(first.sequence, second.sequence);
  EXPECT_EQ(first.exposure_in_picture, 0);
  EXPECT_EQ(second.exposure_in_picture, 1);
  EXPECT_EQ(second.time.monotonic_ns - first.time.monotonic_ns, first.field_period_ns);
  EXPECT_EQ(first.sensor_size, cv::Size(64, 48));
}

TEST(V4l2Source, AlternateFieldsKeepParityOverALostField) {
  const Rig rig(television(V4L2_FIELD_ALTERNATE));
  const auto source = rig.open_and_start();
  rig.camera->expose();
  const Frame first = next(*source);
  rig.camera->skip_sequence(1);  // A top field is lost.
  rig.camera->expose();
  const Frame after = next(*source);
  EXPECT_EQ(first.field, Field::kBottom);
  EXPECT_EQ(first.exposure_number(), 0U);
  EXPECT_EQ(after.field, Field::kBottom);
  EXPECT_EQ(after.exposure_number(), 2U);
  EXPECT_EQ(source->statistics().dropped, 1U);
}

TEST(V4l2Source, StampOfTheEndOfTheFrameIsTurnedIntoTheFirstFieldsMidpoint) {
  const Rig rig(television(V4L2_FIELD_INTERLACED));
  const auto source = rig.open_and_start();
  constexpr std::int64_t kStamp_ns = 123'456'789'000;
  rig.camera->set_next_time_ns(kStamp_ns);
  rig.camera->expose();
  const Frame frame = next(*source);
  const double field_ns = 1e9 * 1001 / 60000;
  EXPECT_NEAR(static_cast<double>(kStamp_ns - frame.time.monotonic_ns), 1.5 * field_ns, 2.0);
  ASSERT_TRUE(frame.time.utc_offset_ns.has_value());
  EXPECT_GT(frame.time.seconds(), 1.6e9) << "seconds since 1970";
}

TEST(V4l2Source, DriverWithoutAMonotonicStampIsTimedOnArrival) {
  FakeCamera::Setup setup;
  setup.stamps_are_monotonic = false;
  const Rig rig(setup);
  const auto source = rig.open_and_start();
  rig.camera->set_next_time_ns(1);
  rig.camera->expose();
  EXPECT_NEAR(1e-9 * static_cast<double>(next(*source).time.monotonic_ns - now_ns()), 0.0, 1.0);
}

// --- The queue ---

TEST(V4l2Source, LateReaderGetsTheNewestAndTheRestIsCounted) {
  Rig rig;
  rig.options.queue = 3;
  const auto source = rig.open_and_start();
  for (int n = 0; n < 9; ++n) {
    rig.camera->expose();
    ASSERT_TRUE(eventually([&] { return rig.camera->queued() >= 6; })) << "taken from the driver";
    const auto discarded = static_cast<std::uint64_t>(std::max(0, n + 1 - 3));
    ASSERT_TRUE(eventually([&] { return source->statistics().overrun == discarded; }));
  }
  EXPECT_EQ(next(*source).sequence, 6U);
  EXPECT_EQ(source->statistics().dropped, 0U) << "none of them lost by the driver";
}

TEST(V4l2Source, ReaderThatKeepsFramesGetsCopiesBeforeTheDriverRunsDry) {
  Rig rig;
  rig.options.buffers = 6;
  const auto source = rig.open_and_start();
  std::vector<Frame> kept;
  for (int n = 0; n < 20; ++n) {
    rig.camera->expose();
    kept.push_back(next(*source));
  }
  EXPECT_EQ(source->statistics().dropped, 0U);
  int in_place = 0;
  for (std::size_t n = 0; n < kept.size(); ++n) {
    EXPECT_EQ(kept[n].image.at<std::uint8_t>(0, 0), n);
    if (kept[n].lease) ++in_place;
  }
  EXPECT_EQ(in_place, 4) << "6 buffers, 2 left to the driver";
}

TEST(V4l2Source, FrameThatComesBackGivesItsBufferToTheDriver) {
  const Rig rig;
  const auto source = rig.open_and_start();
  Frame frame;
  for (int n = 0; n < 50; ++n) {
    rig.camera->expose();
    ASSERT_EQ(source->next(frame, kPatience), NextStatus::kFrame);
    EXPECT_NE(frame.lease, nullptr);
  }
  frame = {};
  EXPECT_EQ(rig.camera->queued(), rig.options.buffers);
}

TEST(V4l2Source, NothingIsLeftOpenOrMappedInTheEnd) {
  const Rig rig;
  Frame kept;
  {
    const auto source = rig.open_and_start();
    rig.camera->expose();
    kept = next(*source);
  }
  EXPECT_FALSE(rig.camera->is_clean()) << "a frame still holds the memory";
  EXPECT_EQ(kept.image.at<std::uint8_t>(0, 0), 0);
  kept = {};
  EXPECT_TRUE(rig.camera->is_clean());
}

}  // namespace
}  // namespace striper::testing
