// SPDX-License-Identifier: Apache-2.0
// Proves that the V4L2 source keeps the promises of a source for every order of fields, for
// images used in place and copied ones, single- and multi-planar. The device is a fake in
// this process: what a kernel's driver does is tried in the virtual machine (tests/v4l2_vm).
#include <map>
#include <memory>

#include "capture/conformance/frame_source_conformance.hpp"
#include "capture/v4l2/fake_camera.hpp"
#include "v4l2/v4l2_stream.hpp"

namespace striper::testing {
namespace {

// A source that keeps its camera running beside it; two opened at once share the camera.
SourceUnderTest fake(const std::string& name, const FakeCamera::Setup& setup) {
  auto shared = std::make_shared<std::weak_ptr<FakeCamera>>();
  const auto open = [setup, shared] {
    std::shared_ptr<FakeCamera> camera = shared->lock();
    if (!camera) {
      camera = std::make_shared<FakeCamera>(setup);
      camera->add_control(V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute",
                          V4L2_CTRL_TYPE_INTEGER, 1, 300, 20);
      camera->add_control(V4L2_CID_HFLIP, "Horizontal Flip", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 0);
      const bool is_field = setup.field == V4L2_FIELD_ALTERNATE;
      const double period_us = setup.standard != 0 ? 1e6 * 1001 / 30000 : 8000.0;
      camera->run(
          std::chrono::microseconds(static_cast<int>(is_field ? period_us / 2 : period_us)));
      *shared = camera;
    }
    V4l2Options options;
    options.device = "/dev/fake";
    return detail::v4l2::open(options, camera);
  };
  return {name, open, false};
}

FakeCamera::Setup television(std::uint32_t code, std::uint32_t field) {
  FakeCamera::Setup setup;
  setup.code = code;
  setup.field = field;
  setup.standard = V4L2_STD_NTSC_M;
  return setup;
}

FakeCamera::Setup camera(std::uint32_t code, bool is_multiplanar) {
  FakeCamera::Setup setup;
  setup.code = code;
  setup.is_multiplanar = is_multiplanar;
  setup.padding = 16;
  setup.stamps_start_of_exposure = is_multiplanar;
  return setup;
}

INSTANTIATE_TEST_SUITE_P(
    V4l2Fake, FrameSourceConformance,
    ::testing::Values(fake("progressive", camera(V4L2_PIX_FMT_GREY, false)),
                      fake("multiplanar", camera(V4L2_PIX_FMT_NV12M, true)),
                      fake("luma", camera(V4L2_PIX_FMT_YUYV, false)),
                      fake("colour", camera(V4L2_PIX_FMT_RGB24, false)),
                      fake("interlaced", television(V4L2_PIX_FMT_GREY, V4L2_FIELD_INTERLACED)),
                      fake("sequential", television(V4L2_PIX_FMT_GREY, V4L2_FIELD_SEQ_BT)),
                      fake("sequential_luma", television(V4L2_PIX_FMT_UYVY, V4L2_FIELD_SEQ_TB)),
                      fake("alternate", television(V4L2_PIX_FMT_GREY, V4L2_FIELD_ALTERNATE))),
    source_name);

}  // namespace
}  // namespace striper::testing
