// SPDX-License-Identifier: Apache-2.0
// Proves what the V4L2 source does with every answer a driver can give: what it chooses, what it
// says when it cannot, how fields, stamps, gaps, damaged pictures, failures and unplugging come
// out. The device is a stand-in; the same against the kernel's own driver is in tests/v4l2_vm.
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/core/log.hpp>

#include "capture/v4l2/stand_in_camera.hpp"
#include "v4l2/v4l2_stream.hpp"

namespace striper {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::StandInCamera;

constexpr milliseconds kPatience{2000};
constexpr milliseconds kNoTime{0};

struct Rig {
  explicit Rig(const StandInCamera::Setup& setup = StandInCamera::Setup{})
      : camera(std::make_shared<StandInCamera>(setup)) {
    options.device = "/dev/video7";
  }
  std::unique_ptr<FrameSource> open() const { return v4l2::open(options, camera); }
  std::unique_ptr<FrameSource> open_and_start() const {
    auto source = open();
    source->start();
    return source;
  }

  std::shared_ptr<StandInCamera> camera;
  V4l2Options options;
};

StandInCamera::Setup television(std::uint32_t field, v4l2_std_id standard = V4L2_STD_NTSC_M) {
  StandInCamera::Setup setup;
  setup.field = field;
  setup.standard = standard;
  return setup;
}

Error error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "nothing was refused";
  return {ErrorKind::kUsage, ""};
}

Frame next(FrameSource& source) {
  Frame frame;
  EXPECT_EQ(source.next(frame, kPatience), NextStatus::kFrame);
  return frame;
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             steady_clock::now().time_since_epoch())
      .count();
}

// Waits until a condition holds: things on the capture thread take a moment.
template <typename Condition>
bool eventually(const Condition& condition) {
  const auto until = steady_clock::now() + kPatience;
  while (!condition()) {
    if (steady_clock::now() > until) return false;
    std::this_thread::sleep_for(milliseconds(1));
  }
  return true;
}

// --- Opening ---

TEST(V4l2Source, EachReasonNotToOpenHasItsOwnMessage) {
  struct Case {
    int error;
    ErrorKind kind;
    const char* says;
  };
  for (const Case& expected : {Case{ENOENT, ErrorKind::kNotFound, "there is no such device"},
                               Case{EACCES, ErrorKind::kDevice, "usermod -aG video"},
                               Case{EBUSY, ErrorKind::kDevice, "another program streams from it"},
                               Case{ENODEV, ErrorKind::kDevice, "plug it in again"}}) {
    Rig rig;
    rig.camera->fail_open(expected.error);
    const Error error = error_of([&] { rig.open(); });
    EXPECT_EQ(error.kind(), expected.kind);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("/dev/video7"), HasSubstr(expected.says)));
  }
}

TEST(V4l2Source, NodeThatIsNoCameraIsRefusedSayingWhatItIs) {
  Rig rig;
  rig.camera->set_capabilities(V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING);
  EXPECT_THAT(error_of([&] { rig.open(); }).what(), HasSubstr("is a video output"));
  rig.camera->set_capabilities(V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING);
  EXPECT_THAT(error_of([&] { rig.open(); }).what(), HasSubstr("node for metadata"));
  EXPECT_TRUE(rig.camera->is_clean());
}

TEST(V4l2Source, FileThatIsNoVideoDeviceIsRefused) {
  Rig rig;
  rig.camera->fail_next(VIDIOC_QUERYCAP, ENOTTY);
  EXPECT_THAT(error_of([&] { rig.open(); }).what(), HasSubstr("not a Video4Linux device"));
  EXPECT_TRUE(rig.camera->is_clean());
}

TEST(V4l2Source, SecondReaderIsToldThatTheDeviceIsBusy) {
  const Rig rig;
  const auto first = rig.open_and_start();
  const Error error = error_of([&] { rig.open_and_start(); });
  EXPECT_EQ(error.kind(), ErrorKind::kDevice);
  EXPECT_THAT(error.what(), HasSubstr("busy"));
}

TEST(V4l2Source, FormatThatTheDeviceLacksIsRefusedNamingThoseItHas) {
  StandInCamera::Setup setup;
  setup.code = V4L2_PIX_FMT_YUYV;
  setup.other_codes = {V4L2_PIX_FMT_MJPEG};
  Rig rig(setup);
  rig.options.format = "Y16";
  const Error error = error_of([&] { rig.open(); });
  EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
  EXPECT_THAT(error.what(), HasSubstr("format=Y16 - 'Stand-in camera' has YUYV, MJPG"));
}

TEST(V4l2Source, BestFormatIsChosenAndSaid) {
  StandInCamera::Setup setup;
  setup.code = V4L2_PIX_FMT_MJPEG;
  setup.other_codes = {V4L2_PIX_FMT_RGB24, V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_YUYV};
  const Rig rig(setup);
  EXPECT_THAT(rig.open()->info().description, HasSubstr("64x48 GREY"));
}

TEST(V4l2Source, SizeThatTheDeviceLacksIsRefusedNamingTheNearest) {
  Rig rig;
  rig.options.width = 100;
  rig.options.height = 80;
  EXPECT_THAT(error_of([&] { rig.open(); }).what(),
              HasSubstr("size=100x80 - the nearest that the driver has is 64x48"));
}

TEST(V4l2Source, UnknownInputIsRefusedNamingThoseThereAre) {
  Rig rig;
  rig.options.input = "Composite";
  EXPECT_THAT(error_of([&] { rig.open(); }).what(), HasSubstr("input=Composite"));
  EXPECT_THAT(error_of([&] { rig.open(); }).what(), HasSubstr("0 (Camera 1)"));
  rig.options.input = "camera 1";
  EXPECT_NO_THROW(rig.open());
}

TEST(V4l2Source, StandardOnAnInputThatHasNoneIsRefused) {
  Rig rig;
  rig.options.standard = "ntsc";
  EXPECT_THAT(error_of([&] { rig.open(); }).what(), HasSubstr("is no television input"));
}

TEST(V4l2Source, InputWithoutSignalOrLockIsRefusedAndCanBeOpenedAllTheSame) {
  Rig rig(television(V4L2_FIELD_INTERLACED));
  rig.camera->set_input_status(V4L2_IN_ST_NO_SIGNAL);
  EXPECT_THAT(error_of([&] { rig.open(); }).what(),
              AllOf(HasSubstr("has no signal"), HasSubstr("signal=ignore")));
  rig.camera->set_input_status(V4L2_IN_ST_NO_H_LOCK);
  EXPECT_THAT(error_of([&] { rig.open(); }).what(), HasSubstr("cannot lock"));
  rig.options.require_signal = false;
  EXPECT_NO_THROW(rig.open());
}

TEST(V4l2Source, StandardThatCannotBeToldIsAskedFor) {
  Rig rig(television(V4L2_FIELD_INTERLACED, V4L2_STD_ALL));
  rig.options.standard = "auto";
  EXPECT_THAT(error_of([&] { rig.open(); }).what(), HasSubstr("say standard=ntsc or standard=pal"));
}

TEST(V4l2Source, ControlsAreSetByNameAndAutomaticModesFirst) {
  Rig rig;
  rig.camera->add_control(V4L2_CID_GAIN, "Gain", V4L2_CTRL_TYPE_INTEGER, 0, 255, 7);
  rig.camera->add_control(V4L2_CID_EXPOSURE_AUTO, "Auto Exposure", V4L2_CTRL_TYPE_INTEGER, 0, 3, 0);
  rig.camera->add_control(V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute",
                          V4L2_CTRL_TYPE_INTEGER, 1, 5000, 100);
  rig.options.controls = {{"gain", "99"}, {"exposure_absolute", "2"}, {"exposure_auto", "1"}};
  const auto source = rig.open_and_start();
  EXPECT_EQ(rig.camera->control_value(V4L2_CID_GAIN), 99);
  EXPECT_EQ(rig.camera->control_value(V4L2_CID_EXPOSURE_ABSOLUTE), 2);
  rig.camera->expose();
  EXPECT_EQ(next(*source).exposure_ns, 200'000);
}

TEST(V4l2Source, ExposureInMicrosecondsSwitchesTheAutomaticOff) {
  Rig rig;
  rig.camera->add_control(V4L2_CID_EXPOSURE_AUTO, "Auto Exposure", V4L2_CTRL_TYPE_INTEGER, 0, 3, 3);
  rig.camera->add_control(V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute",
                          V4L2_CTRL_TYPE_INTEGER, 1, 5000, 100);
  rig.options.exposure_us = 300;
  rig.open();
  EXPECT_EQ(rig.camera->control_value(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(rig.camera->control_value(V4L2_CID_EXPOSURE_ABSOLUTE), 3);
}

TEST(V4l2Source, UnknownControlAndValueOutOfBoundsAreRefusedByName) {
  Rig rig;
  rig.camera->add_control(V4L2_CID_GAIN, "Gain", V4L2_CTRL_TYPE_INTEGER, 0, 255, 7);
  rig.options.controls = {{"gian", "1"}};
  EXPECT_THAT(error_of([&] { rig.open(); }).what(),
              AllOf(HasSubstr("'gian'"), HasSubstr("has gain")));
  rig.options.controls = {{"gain", "256"}};
  EXPECT_THAT(error_of([&] { rig.open(); }).what(),
              HasSubstr("gain=256 - expected a whole number from 0 to 255"));
}

TEST(V4l2Options, AreReadFromTheAddress) {
  const V4l2Options options = V4l2Options::from_uri(SourceUri::parse(
      "v4l2:/dev/video3?standard=pal&size=720x576&field=seq-tb&format=grey&reconnect=5&gain=3"
      "&laser=0,dark&signal=ignore&input=S-Video"));
  EXPECT_EQ(options.device, "/dev/video3");
  EXPECT_EQ(options.width, 720);
  EXPECT_EQ(options.height, 576);
  EXPECT_EQ(options.reconnect_s, 5.0);
  EXPECT_FALSE(options.require_signal);
  EXPECT_EQ(options.cadence.to_string(), "0,dark");
  EXPECT_EQ(options.controls.at("gain"), "3");
}

TEST(V4l2Options, ValuesThatMakeNoSenseAreQuoted) {
  const auto message = [](const std::string& query) {
    return std::string(error_of([&] {
                         V4l2Options::from_uri(SourceUri::parse("v4l2:/dev/video0?" + query));
                       }).what());
  };
  EXPECT_THAT(message("size=720"), HasSubstr("size=720 - expected WIDTHxHEIGHT"));
  EXPECT_THAT(message("size=0x5"), HasSubstr("size=0x5"));
  EXPECT_THAT(message("standard=ntcs"), HasSubstr("standard=ntcs - expected auto, ntsc"));
  EXPECT_THAT(message("field=both"), HasSubstr("field=both - expected none"));
  EXPECT_THAT(message("format=greyscale"), HasSubstr("four-character code"));
  EXPECT_THAT(message("signal=maybe"), HasSubstr("require or ignore"));
  EXPECT_THAT(message("reconnect=perhaps"), HasSubstr("reconnect=perhaps"));
  EXPECT_THAT(message("queue=99"), HasSubstr("queue=99"));
}

// --- Fields, numbers and times ---

TEST(V4l2Source, GreyPicturesAreGivenInTheDriversOwnMemory) {
  const Rig rig;
  const auto source = rig.open_and_start();
  rig.camera->expose();
  const Frame frame = next(*source);
  EXPECT_NE(frame.lease, nullptr);
  EXPECT_EQ(frame.image.u, nullptr) << "not allocated";
  EXPECT_EQ(frame.image.at<std::uint8_t>(3, 3), 0);
}

TEST(V4l2Source, DeepGreyOfPaddedRowsIsGivenInPlaceToo) {
  StandInCamera::Setup setup;
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

TEST(V4l2Source, StampOfTheEndOfThePictureIsTurnedIntoTheFirstFieldsMidpoint) {
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
  StandInCamera::Setup setup;
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
  for (int picture = 0; picture < 9; ++picture) {
    rig.camera->expose();
    ASSERT_TRUE(eventually([&] { return rig.camera->queued() >= 6; })) << "taken from the driver";
    const auto discarded = static_cast<std::uint64_t>(std::max(0, picture + 1 - 3));
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
  for (int picture = 0; picture < 20; ++picture) {
    rig.camera->expose();
    kept.push_back(next(*source));
  }
  EXPECT_EQ(source->statistics().dropped, 0U);
  int in_place = 0;
  for (std::size_t picture = 0; picture < kept.size(); ++picture) {
    EXPECT_EQ(kept[picture].image.at<std::uint8_t>(0, 0), picture);
    if (kept[picture].lease) ++in_place;
  }
  EXPECT_EQ(in_place, 4) << "6 buffers, 2 left to the driver";
}

TEST(V4l2Source, FrameThatComesBackGivesItsBufferToTheDriver) {
  const Rig rig;
  const auto source = rig.open_and_start();
  Frame frame;
  for (int picture = 0; picture < 50; ++picture) {
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

// --- Faults ---

TEST(V4l2Source, FlaggedPictureIsGivenWithoutPixelsAndCounted) {
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

TEST(V4l2Source, HalfFilledPictureIsIncomplete) {
  const Rig rig;
  const auto source = rig.open_and_start();
  rig.camera->expose(0, 1000);
  EXPECT_EQ(next(*source).status, FrameStatus::kIncomplete);
  EXPECT_EQ(source->statistics().incomplete, 1U);
}

TEST(V4l2Source, PicturesWithoutSignalAreNotUsed) {
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
  EXPECT_EQ(exposed(back_ns), FrameStatus::kCorrupt) << "its first lines are of before";
  EXPECT_EQ(exposed(back_ns + kPeriod_ns + 1000), FrameStatus::kOk);
  EXPECT_EQ(source->statistics().corrupt, 4U);
}

// The capture thread came late: several pictures of noise lie there when the signal is back.
TEST(V4l2Source, PicturesOfNoiseThatWereLyingThereAreNotUsedAfterTheSignalIsBack) {
  const Rig rig(television(V4L2_FIELD_INTERLACED));
  const auto source = rig.open_and_start();
  rig.camera->set_input_status(V4L2_IN_ST_NO_SIGNAL);
  rig.camera->expose();
  EXPECT_EQ(next(*source).status, FrameStatus::kCorrupt);
  const std::int64_t lost_ns = now_ns();
  rig.camera->set_input_status(0);
  for (int picture = 0; picture < 3; ++picture) {
    rig.camera->set_next_time_ns(lost_ns);
    rig.camera->expose();
    EXPECT_EQ(next(*source).status, FrameStatus::kCorrupt);
  }
}

// The first answer comes late because something else had the processor; the device itself is quick.
TEST(V4l2Source, OneLateAnswerAboutTheSignalLetsNoNoisePass) {
  const Rig rig(television(V4L2_FIELD_ALTERNATE));
  const auto source = rig.open();
  rig.camera->delay_next(VIDIOC_ENUMINPUT, milliseconds(30));
  source->start();
  rig.camera->expose();
  EXPECT_EQ(next(*source).status, FrameStatus::kOk);
  rig.camera->set_input_status(V4L2_IN_ST_NO_SIGNAL);
  rig.camera->expose();
  EXPECT_EQ(next(*source).status, FrameStatus::kCorrupt);
}

TEST(V4l2Source, SlowGrabberIsAskedForItsSignalTenTimesASecond) {
  const Rig rig(television(V4L2_FIELD_ALTERNATE));
  const auto source = rig.open();
  rig.camera->delay_next(VIDIOC_ENUMINPUT, milliseconds(8), 1000);
  source->start();
  rig.camera->set_input_status(V4L2_IN_ST_NO_SIGNAL);
  const auto lost_at = steady_clock::now();
  const auto is_seen = [&] {
    rig.camera->expose();
    return next(*source).status == FrameStatus::kCorrupt;
  };
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
  EXPECT_TRUE(eventually([&] { return rig.camera->queued() == 3; })) << "all but the one in hand";
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
  StandInCamera::Setup setup = television(V4L2_FIELD_ALTERNATE);
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
  StandInCamera::Setup setup;
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
}  // namespace striper
