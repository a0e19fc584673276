// SPDX-License-Identifier: Apache-2.0
// Proves that the V4L2 source keeps the promises of a source on a kernel driver: vivid in the
// virtual machine, or a camera of yours (STRIPER_VIDEO_DEVICE=/dev/video0).
#include <striper/capture/open_source.hpp>

#include "capture/conformance/frame_source_conformance.hpp"
#include "v4l2_vm/vivid.hpp"

namespace striper::testing {
namespace {

std::string absent_device() {
  return Node(capture_path()).is_open()
             ? std::string()
             : "there is no " + capture_path() + ": tests/v4l2_vm/run_in_vm.sh brings one";
}

std::string absent_vivid(const std::string& path) {
  return Node(path).is_vivid() ? std::string() : path + " is not the kernel's virtual driver";
}

SourceUnderTest own_choice() {
  return {"own_choice", [] { return open_source("v4l2:" + capture_path()); }, false, absent_device};
}

SourceUnderTest vivid(const std::string& name, const std::string& path, const std::string& query) {
  return {name, [=] { return open_source("v4l2:" + path + "?" + query); }, false,
          [=] { return absent_vivid(path); }};
}

// The second device of run_in_vm.sh's driver has the multi-planar API.
INSTANTIATE_TEST_SUITE_P(
    V4l2, FrameSourceConformance,
    ::testing::Values(own_choice(),
                      vivid("webcam", "/dev/video0", "input=1&format=YUYV&size=640x360&fps=30"),
                      vivid("interlaced", "/dev/video0", "input=0&standard=ntsc-m&format=GREY"),
                      vivid("sequential", "/dev/video0", "input=0&standard=pal&field=seq-tb"),
                      vivid("alternate", "/dev/video0", "input=0&standard=ntsc-m&field=alternate"),
                      vivid("multiplanar", "/dev/video2", "input=0&standard=ntsc-m&format=NM12")),
    source_name);

}  // namespace
}  // namespace striper::testing
