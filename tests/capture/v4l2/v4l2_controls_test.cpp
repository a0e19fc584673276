// SPDX-License-Identifier: Apache-2.0
// Proves that the controls of a V4L2 source are those of its device, set while it streams, and that
// frames say the exposure that they have. The device is a fake: what a driver does is tried in
// the virtual machine.
#include <gmock/gmock.h>

#include "capture/v4l2/fake_rig.hpp"

namespace striper::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct ControlledRig : Rig {
  ControlledRig() {
    camera->add_control(V4L2_CID_EXPOSURE_AUTO, "Auto Exposure", V4L2_CTRL_TYPE_INTEGER, 0, 3, 3);
    camera->add_control(V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute",
                        V4L2_CTRL_TYPE_INTEGER, 1, 300, 20);
    camera->add_control(V4L2_CID_GAIN, "Gain", V4L2_CTRL_TYPE_INTEGER, 0, 100, 7);
    camera->add_control(V4L2_CID_HFLIP, "Horizontal Flip", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 0);
  }
};

TEST(V4l2Controls, AreThoseOfTheDevice) {
  const ControlledRig rig;
  const auto source = rig.open();
  std::vector<std::string> names;
  for (const Control& control : source->controls().list()) names.push_back(control.name);
  EXPECT_THAT(names,
              ::testing::UnorderedElementsAre("exposure_us", "region", "auto_exposure",
                                              "exposure_time_absolute", "gain", "horizontal_flip"));
  EXPECT_EQ(source->controls().get("horizontal_flip").type, ControlType::kSwitch);
  EXPECT_THAT(source->controls().get("region").state.value, ElementsAre(0, 0, 64, 48));
  EXPECT_THAT(source->controls().get("gain").state.maximum, ElementsAre(100));
}

TEST(V4l2Controls, ExposureIsSetWhileItStreamsAndFramesSayIt) {
  ControlledRig rig;
  const auto source = rig.open_and_start();
  EXPECT_THAT(source->controls().set("exposure_us", {5040.0}).state.value, ElementsAre(5000.0));
  EXPECT_EQ(rig.camera->control_value(V4L2_CID_EXPOSURE_ABSOLUTE), 50);
  EXPECT_EQ(rig.camera->control_value(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  rig.camera->expose();
  EXPECT_EQ(next(*source).exposure_ns, 5'000'000);
  source->controls().set("exposure_time_absolute", {12.0});
  rig.camera->expose();
  EXPECT_EQ(next(*source).exposure_ns, 1'200'000);
  source->controls().set("horizontal_flip", {1.0});
  EXPECT_EQ(rig.camera->control_value(V4L2_CID_HFLIP), 1);
}

TEST(V4l2Controls, ErrorsNameControlValueAndRange) {
  ControlledRig rig;
  const auto source = rig.open_and_start();
  const Error range = error_of([&] { source->controls().set("exposure_us", {50.0}); });
  EXPECT_EQ(range.kind(), ErrorKind::kBadValue);
  EXPECT_THAT(range.what(),
              HasSubstr("'v4l2:/dev/video7': exposure_us=50 - expected 100 to 30000 us"));
  const Error absent = error_of([&] { source->controls().set("gain_db", {5.0}); });
  EXPECT_THAT(absent.what(), HasSubstr("no control 'gain_db'; it knows exposure_us, region, "));
  rig.camera->unplug();
  EXPECT_THROW(source->controls().set("gain", {5.0}), Error);
}

}  // namespace
}  // namespace striper::testing
