// SPDX-License-Identifier: Apache-2.0
// Proves that the simulator, whole and by fields, in its own time and in real time, keeps the
// promises of a source.
#include <string>

#include <striper/capture/open_source.hpp>

#include "capture/conformance/frame_source_conformance.hpp"
#include "support/shared_data.hpp"

namespace striper::testing {
namespace {

SourceUnderTest scene(const std::string& name, const std::string& file, const std::string& query) {
  return {name,
          [file, query] {
            return open_source("sim:" + source_path("data/scenes/" + file).string() + query);
          },
          true};
}

INSTANTIATE_TEST_SUITE_P(
    Simulator, FrameSourceConformance,
    ::testing::Values(scene("limited", "wall.yaml", "?frames=30&fps=50&laser=0,dark"),
                      scene("interlaced", "ntsc_sun.yaml", "?frames=30"),
                      scene("alternate", "ntsc_sun.yaml", "?fields=alternate-top&laser=0,dark"),
                      scene("realtime", "wall.yaml", "?fps=20&realtime=yes")),
    source_name);

}  // namespace
}  // namespace striper::testing
