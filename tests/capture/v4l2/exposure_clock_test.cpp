// SPDX-License-Identifier: Apache-2.0
// Proves how a driver's stamps become frame numbers and exposure times: wrap-around, gaps,
// fields, interruptions, both kinds of stamp. Not how well a real driver's stamps fit its shutter.
#include "v4l2/buffers/exposure_clock.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace striper::detail::v4l2 {
namespace {

constexpr std::int64_t kPeriod_ns = 33'366'667;
constexpr std::int64_t kField_ns = kPeriod_ns / 2;
constexpr std::int64_t kStart_ns = 5'000'000'000;

ExposureClock::Stream progressive() {
  ExposureClock::Stream stream;
  stream.frame_period_ns = kPeriod_ns;
  return stream;
}

ExposureClock::Stream alternate_bottom_first() {
  ExposureClock::Stream stream = progressive();
  stream.exposures_per_picture = 2;
  stream.is_one_field_a_buffer = true;
  stream.first_field = Field::kBottom;
  return stream;
}

BufferStamp stamp(std::uint32_t sequence, std::int64_t time_ns, Field field = Field::kProgressive) {
  return {sequence, time_ns, false, field};
}

TEST(ExposureClock, NumbersFromZeroWhateverTheDriverBeginsWith) {
  ExposureClock clock(progressive());
  EXPECT_EQ(clock.place(stamp(17, kStart_ns)).frame, 0U);
  EXPECT_EQ(clock.place(stamp(18, kStart_ns + kPeriod_ns)).frame, 1U);
}

TEST(ExposureClock, GapIsCountedAsLostFrames) {
  ExposureClock clock(progressive());
  clock.place(stamp(0, kStart_ns));
  const ExposurePlace place = clock.place(stamp(4, kStart_ns + 4 * kPeriod_ns));
  EXPECT_EQ(place.frame, 4U);
  EXPECT_EQ(place.lost_frames, 3U);
}

// An emulated or busy machine stamps two frames a moment apart: the second field of the one must
// not come after the first field of the other.
TEST(ExposureClock, TimesGrowFromFieldToFieldHoweverLateTheStamps) {
  ExposureClock::Stream stream = progressive();
  stream.exposures_per_picture = 2;
  ExposureClock clock(stream);
  const ExposurePlace late = clock.place(stamp(0, kStart_ns));
  const ExposurePlace hurried = clock.place(stamp(1, kStart_ns + 1'000'000));
  EXPECT_GT(hurried.midpoint_ns, late.midpoint_ns + kField_ns);
  EXPECT_EQ(hurried.began_ns - late.began_ns, 1'000'000) << "as stamped";
}

TEST(ExposureClock, DriversCountWrapsAround) {
  ExposureClock clock(progressive());
  clock.place(stamp(std::numeric_limits<std::uint32_t>::max(), kStart_ns));
  const ExposurePlace place = clock.place(stamp(1, kStart_ns + 2 * kPeriod_ns));
  EXPECT_EQ(place.frame, 2U);
  EXPECT_EQ(place.lost_frames, 1U);
}

TEST(ExposureClock, DriverThatDoesNotCountGivesConsecutiveFrames) {
  ExposureClock clock(progressive());
  for (std::uint64_t frame = 0; frame < 5; ++frame) {
    const auto time_ns = kStart_ns + static_cast<std::int64_t>(frame) * kPeriod_ns;
    EXPECT_EQ(clock.place(stamp(0, time_ns)).frame, frame);
  }
}

TEST(ExposureClock, EndOfFrameStampIsHalfAPeriodAfterTheMidpoint) {
  ExposureClock clock(progressive());
  EXPECT_EQ(clock.place(stamp(0, kStart_ns)).midpoint_ns, kStart_ns - kPeriod_ns / 2);
}

TEST(ExposureClock, EndOfFrameStampOfAnInterlacedFrameIsThreeHalfFieldsAfterTheFirstField) {
  ExposureClock::Stream stream = progressive();
  stream.exposures_per_picture = 2;
  ExposureClock clock(stream);
  EXPECT_EQ(clock.place(stamp(0, kStart_ns)).midpoint_ns, kStart_ns - kField_ns / 2 - kField_ns);
}

TEST(ExposureClock, StartOfExposureStampIsHalfTheExposureBeforeTheMidpoint) {
  ExposureClock::Stream stream = progressive();
  stream.exposure_ns = 200'000;
  stream.offset_ns = -7;
  ExposureClock clock(stream);
  EXPECT_EQ(clock.place({0, kStart_ns, true, Field::kProgressive}).midpoint_ns,
            kStart_ns + 100'000 - 7);
}

TEST(ExposureClock, TimesGrowEvenWhereTheDriversClockJumpsBack) {
  ExposureClock clock(progressive());
  const std::int64_t first = clock.place(stamp(0, kStart_ns)).midpoint_ns;
  EXPECT_GT(clock.place(stamp(1, kStart_ns - 1000)).midpoint_ns, first);
}

TEST(ExposureClock, TwoFieldsWithOneNumberAreOneFrame) {
  ExposureClock clock(alternate_bottom_first());
  for (std::uint32_t field = 0; field < 8; ++field) {
    const ExposurePlace place = clock.place(stamp(field / 2, kStart_ns + field * kField_ns,
                                                  field % 2 == 0 ? Field::kBottom : Field::kTop));
    EXPECT_EQ(place.frame, field / 2);
    EXPECT_EQ(place.exposure_in_picture, static_cast<int>(field % 2));
    EXPECT_EQ(place.lost_frames, 0U);
  }
}

TEST(ExposureClock, DriverThatCountsFieldsGivesTheSameFrames) {
  ExposureClock clock(alternate_bottom_first());
  for (std::uint32_t field = 0; field < 8; ++field) {
    const ExposurePlace place = clock.place(
        stamp(field, kStart_ns + field * kField_ns, field % 2 == 0 ? Field::kBottom : Field::kTop));
    EXPECT_EQ(place.frame, field / 2);
    EXPECT_EQ(place.exposure_in_picture, static_cast<int>(field % 2));
  }
}

TEST(ExposureClock, StreamThatBeginsWithASecondFieldKeepsItsPlace) {
  ExposureClock clock(alternate_bottom_first());
  const ExposurePlace first = clock.place(stamp(0, kStart_ns, Field::kTop));
  EXPECT_EQ(first.frame, 0U);
  EXPECT_EQ(first.exposure_in_picture, 1);
  const ExposurePlace second = clock.place(stamp(1, kStart_ns + kField_ns, Field::kBottom));
  EXPECT_EQ(second.frame, 1U);
  EXPECT_EQ(second.exposure_in_picture, 0);
}

TEST(ExposureClock, LostFieldLeavesItsPlaceEmptyAndIsCounted) {
  ExposureClock clock(alternate_bottom_first());
  clock.place(stamp(0, kStart_ns, Field::kBottom));
  const ExposurePlace place = clock.place(stamp(1, kStart_ns + 3 * kField_ns, Field::kTop));
  EXPECT_EQ(place.frame, 1U);
  EXPECT_EQ(place.exposure_in_picture, 1);
  EXPECT_EQ(place.lost_frames, 1U);
}

TEST(ExposureClock, AfterAnInterruptionNumbersGoOnByTheTimeThatPassed) {
  ExposureClock clock(progressive());
  clock.place(stamp(100, kStart_ns));
  clock.interrupt();
  const ExposurePlace place = clock.place(stamp(0, kStart_ns + 30 * kPeriod_ns + kPeriod_ns / 5));
  EXPECT_EQ(place.frame, 30U);
  EXPECT_EQ(place.lost_frames, 29U);
}

TEST(ExposureClock, AfterAnInterruptionAFieldKeepsItsParity) {
  for (const Field field : {Field::kBottom, Field::kTop}) {
    ExposureClock clock(alternate_bottom_first());
    clock.place(stamp(100, kStart_ns, Field::kBottom));
    clock.interrupt();
    const int place = field == Field::kBottom ? 0 : 1;
    const ExposurePlace after =
        clock.place(stamp(0, kStart_ns + (20 + place) * kField_ns + kField_ns / 4, field));
    EXPECT_EQ(after.frame, 10U);
    EXPECT_EQ(after.exposure_in_picture, place);
  }
}

TEST(ExposureClock, CountThatJumpsBackIsAnInterruption) {
  ExposureClock clock(progressive());
  clock.place(stamp(1000, kStart_ns));
  EXPECT_EQ(clock.place(stamp(0, kStart_ns + 3 * kPeriod_ns)).frame, 3U);
}

}  // namespace
}  // namespace striper::detail::v4l2
