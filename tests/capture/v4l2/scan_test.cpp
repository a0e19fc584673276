// SPDX-License-Identifier: Apache-2.0
// Proves that a camera behind the kernel's calls gives the images bit for bit and the scans to
// 1e-9 m that the simulator gives directly: NTSC and PAL, every order of fields, grey of 8 and 16
// bits and luma; and that lost fields cost exactly the scans that they belong to. The device is a
// fake in this process: the same on the kernel's own driver is in tests/v4l2_vm.
#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "capture/v4l2/fake_camera.hpp"
#include "capture/v4l2/interlaced_scene.hpp"
#include "support/random.hpp"
#include "v4l2/v4l2_stream.hpp"

namespace striper::testing {
namespace {

constexpr std::chrono::milliseconds kPatience{2000};

struct Studio {
  explicit Studio(const Television& way) : scene(way), buffers(buffers_of(scene.whole.image, way)) {
    FakeCamera::Setup setup;
    setup.code = way.code;
    setup.width = scene.whole.image.cols;
    setup.height = scene.whole.image.rows;
    setup.field = way.field;
    setup.standard = way.standard;
    camera = std::make_shared<FakeCamera>(setup);
    camera->set_pixels([this](std::uint8_t* data, std::size_t bytes, std::uint64_t count) {
      const std::vector<std::uint8_t>& buffer = buffers[count % buffers.size()];
      std::memcpy(data, buffer.data(), std::min(bytes, buffer.size()));
    });
    source = detail::v4l2::open(
        V4l2Options::from_uri(SourceUri::parse("v4l2:/dev/fake?laser=0,dark&" + way.query())),
        camera);
    scans = std::make_unique<SideBySide>(scene, source->info().pattern);
    source->start();
  }

  InterlacedScene scene;
  std::vector<std::vector<std::uint8_t>> buffers;
  std::shared_ptr<FakeCamera> camera;
  std::unique_ptr<FrameSource> source;
  std::unique_ptr<SideBySide> scans;
};

class V4l2Scans : public ::testing::TestWithParam<Television> {};

TEST_P(V4l2Scans, AreThoseThatTheSimulatorGivesDirectly) {
  constexpr int kWholeFrames = 6;
  const Television& way = GetParam();
  Studio studio(way);
  ASSERT_GT(studio.scans->good_columns(), 600) << "the scene is to be seen";
  const int frames_a_buffer = V4L2_FIELD_IS_SEQUENTIAL(way.field) ? 2 : 1;
  const int frames = V4L2_FIELD_IS_INTERLACED(way.field) ? kWholeFrames : 2 * kWholeFrames;
  Frame frame;
  for (int number = 0; number < frames; ++number) {
    if (number % frames_a_buffer == 0) studio.camera->expose();
    ASSERT_EQ(studio.source->next(frame, kPatience), NextStatus::kFrame);
    EXPECT_TRUE(is_part_of(frame, studio.scene.whole.image)) << "frame " << number;
    studio.scans->process(frame);
  }
  studio.scans->finish();
  EXPECT_EQ(studio.scans->scanned().size(), static_cast<std::size_t>(kWholeFrames));
  EXPECT_LE(studio.scans->worst_m(), 1e-9);
  EXPECT_EQ(studio.scans->statistics().unpaired, 0U);
}

// Of fields that come one by one, a fifth is lost and a tenth is flagged as damaged.
TEST(V4l2LostFields, CostTheirOwnScansAndFalsifyNone) {
  constexpr int kFields = 300;
  constexpr std::int64_t kField_ns = 16'683'333;
  Studio studio({"alternate", V4L2_PIX_FMT_GREY, V4L2_FIELD_ALTERNATE});
  std::vector<Frame> frames;
  std::uint64_t lost = 0;
  std::uint64_t flagged = 0;
  for (int field = 0; field < kFields; ++field) {
    const double fate = field == 0 ? 1.0 : uniform(0.0, 1.0);
    if (fate < 0.2) {
      studio.camera->skip_sequence(1);
      ++lost;
      continue;
    }
    studio.camera->set_next_time_ns((field + 100) * kField_ns);
    studio.camera->expose(fate < 0.3 ? V4L2_BUF_FLAG_ERROR : 0);
    if (fate < 0.3) ++flagged;
    Frame frame;
    ASSERT_EQ(studio.source->next(frame, kPatience), NextStatus::kFrame);
    ASSERT_EQ(frame.exposure_number(), static_cast<std::uint64_t>(field)) << "number and parity";
    frames.push_back(without_pixels(frame));
    studio.scans->process(frame);
  }
  studio.scans->finish();
  EXPECT_EQ(studio.scans->scanned(), frames_with_a_pair(frames));
  EXPECT_LE(studio.scans->worst_m(), 1e-9);
  EXPECT_LT(studio.scans->worst_sigmas(), 10.0)
      << "with one dark neighbour instead of two only the noise differs";
  EXPECT_EQ(studio.source->statistics().corrupt, flagged);
  EXPECT_LE(studio.source->statistics().dropped, lost) << "counted in frames";
  EXPECT_GT(studio.source->statistics().dropped, lost / 2);
}

INSTANTIATE_TEST_SUITE_P(Sent, V4l2Scans, ::testing::ValuesIn(ways_of_television()),
                         [](const auto& way) { return way.param.name; });

}  // namespace
}  // namespace striper::testing
