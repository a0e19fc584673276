// SPDX-License-Identifier: Apache-2.0
// Proves what opening a V4L2 source chooses, and what it says where it cannot: device, input,
// signal, standard, format, controls, and the keys of its address. The device is a fake; the
// same against the kernel's own driver is in tests/v4l2_vm.
#include <cerrno>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/v4l2/fake_rig.hpp"

namespace striper::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

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
  FakeCamera::Setup setup;
  setup.code = V4L2_PIX_FMT_YUYV;
  setup.other_codes = {V4L2_PIX_FMT_MJPEG};
  Rig rig(setup);
  rig.options.format = "Y16";
  const Error error = error_of([&] { rig.open(); });
  EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
  EXPECT_THAT(error.what(), HasSubstr("format=Y16 - 'Fake camera' has YUYV, MJPG"));
}

TEST(V4l2Source, BestFormatIsChosenAndSaid) {
  FakeCamera::Setup setup;
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

TEST(V4l2Source, ExposureThatTheCameraCannotTakeIsRefusedWithItsRange) {
  for (const double exposure_us : {20.0, 500'100.0}) {
    Rig rig;
    rig.camera->add_control(V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute",
                            V4L2_CTRL_TYPE_INTEGER, 1, 5000, 100);
    rig.options.exposure_us = exposure_us;
    EXPECT_THAT(error_of([&] { rig.open(); }).what(),
                HasSubstr("the camera takes 100 to 500000, in steps of 100"));
  }
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
  EXPECT_EQ(options.pattern.to_string(), "0,dark");
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

}  // namespace
}  // namespace striper::testing
