// SPDX-License-Identifier: Apache-2.0
// Proves that a listing holds what the device says of itself, and that what is no camera is
// refused. The device is a fake; tests/v4l2_vm compares listings of a kernel driver with
// v4l2-ctl's.
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/capture/camera_listing.hpp>
#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/v4l2/v4l2_devices.hpp>

#include "capture/v4l2/fake_camera.hpp"
#include "v4l2/v4l2_stream.hpp"

namespace striper {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using testing::FakeCamera;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(CameraListing, HoldsWhatAGrabberSaysOfItself) {
  FakeCamera::Setup setup;
  setup.standard = V4L2_STD_NTSC_M;
  setup.other_codes = {V4L2_PIX_FMT_YUYV, v4l2_fourcc('X', 'Y', 'Z', '9')};
  const auto camera = std::make_shared<FakeCamera>(setup);
  const CameraListing listing = detail::v4l2::describe("/dev/video7", camera);
  EXPECT_EQ(listing.uri, "v4l2:/dev/video7");
  EXPECT_EQ(listing.kind, "v4l2");
  EXPECT_EQ(listing.name, "Fake camera");
  EXPECT_EQ(listing.driver, "fake");
  EXPECT_EQ(listing.address, "test:0");
  EXPECT_THAT(listing.trouble, IsEmpty());
  ASSERT_EQ(listing.inputs.size(), 1U);
  EXPECT_EQ(listing.inputs[0].name, "S-Video");
  EXPECT_TRUE(listing.inputs[0].is_current);
  EXPECT_THAT(listing.inputs[0].standards, Contains("ntsc-m"));
  EXPECT_THAT(listing.inputs[0].trouble, IsEmpty());
  ASSERT_EQ(listing.formats.size(), 3U);
  EXPECT_EQ(listing.formats[0].name, "GREY");
  EXPECT_TRUE(listing.formats[0].is_usable);
  EXPECT_EQ(listing.formats[2].name, "XYZ9");
  EXPECT_FALSE(listing.formats[2].is_usable);
  EXPECT_TRUE(camera->is_clean()) << "nothing stays open";
}

TEST(CameraListing, SaysWhatIsWrongWithAnInputsSignal) {
  FakeCamera::Setup setup;
  setup.standard = V4L2_STD_NTSC_M;
  const auto camera = std::make_shared<FakeCamera>(setup);
  camera->set_input_status(V4L2_IN_ST_NO_SIGNAL);
  EXPECT_THAT(detail::v4l2::describe("/dev/video7", camera).inputs.at(0).trouble,
              HasSubstr("has no signal"));
}

TEST(CameraListing, HoldsEveryControlWithItsBoundsAndValue) {
  const auto camera = std::make_shared<FakeCamera>();
  camera->add_control(V4L2_CID_GAIN, "Gain", V4L2_CTRL_TYPE_INTEGER, -3, 255, 7);
  camera->add_control(V4L2_CID_HFLIP, "Horizontal Flip", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 1);
  const CameraListing listing = detail::v4l2::describe("/dev/video7", camera);
  ASSERT_EQ(listing.controls.size(), 2U);
  for (const CameraControl& control : listing.controls) {
    const bool is_gain = control.name == "gain";
    EXPECT_EQ(control.type, is_gain ? "integer" : "boolean") << control.name;
    EXPECT_EQ(control.minimum, is_gain ? -3.0 : 0.0);
    EXPECT_EQ(control.maximum, is_gain ? 255.0 : 1.0);
    EXPECT_EQ(control.value, is_gain ? 7.0 : 1.0);
    EXPECT_TRUE(control.is_settable);
  }
}

TEST(CameraListing, NodeThatIsNoCameraIsRefused) {
  const auto camera = std::make_shared<FakeCamera>();
  camera->set_capabilities(V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING);
  EXPECT_THROW(detail::v4l2::describe("/dev/video7", camera), Error);
  EXPECT_TRUE(camera->is_clean());
}

}  // namespace
}  // namespace striper
