// SPDX-License-Identifier: Apache-2.0
// Proves that a camera behind the kernel's calls gives the pictures bit for bit and the scans to
// 1e-9 m that the simulator gives directly: NTSC and PAL, every order of fields, grey of 8 and 16
// bits and luma; and that lost fields cost exactly the scans that they belong to. The device is a
// stand-in in this process: the same on the kernel's own driver is in tests/v4l2_vm.
#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include <striper/pipeline/scanner.hpp>

#include "capture/v4l2/stand_in_camera.hpp"
#include "capture/v4l2/televised_scene.hpp"
#include "support/random.hpp"
#include "v4l2/v4l2_stream.hpp"

namespace striper::testing {
namespace {

constexpr std::chrono::milliseconds kPatience{2000};

struct Studio {
  explicit Studio(const Television& way)
      : scene(way), buffers(buffers_of(scene.picture.image, way)) {
    StandInCamera::Setup setup;
    setup.code = way.code;
    setup.width = scene.picture.image.cols;
    setup.height = scene.picture.image.rows;
    setup.field = way.field;
    setup.standard = way.standard;
    camera = std::make_shared<StandInCamera>(setup);
    camera->set_pixels([this](std::uint8_t* data, std::size_t bytes, std::uint64_t count) {
      const std::vector<std::uint8_t>& buffer = buffers[count % buffers.size()];
      std::memcpy(data, buffer.data(), std::min(bytes, buffer.size()));
    });
    source = v4l2::open(
        V4l2Options::from_uri(SourceUri::parse("v4l2:/dev/stand-in?laser=0,dark&" + way.query())),
        camera);
    ScannerOptions options = ScannerOptions::for_model(scene.model);
    options.ambient.cadence = source->info().cadence;
    scanner = std::make_unique<Scanner>(scene.model, options);
    source->start();
  }

  TelevisedScene scene;
  std::vector<std::vector<std::uint8_t>> buffers;
  std::shared_ptr<StandInCamera> camera;
  std::unique_ptr<FrameSource> source;
  std::unique_ptr<Scanner> scanner;
};

class V4l2Scans : public ::testing::TestWithParam<Television> {};

TEST_P(V4l2Scans, AreThoseThatTheSimulatorGivesDirectly) {
  constexpr int kPictures = 6;
  const Television& way = GetParam();
  Studio studio(way);
  ASSERT_GT(good_returns(studio.scene.scan), 600) << "the scene is to be seen";
  const int frames = V4L2_FIELD_IS_INTERLACED(way.field) ? kPictures : 2 * kPictures;
  const int frames_a_buffer = V4L2_FIELD_IS_SEQUENTIAL(way.field) ? 2 : 1;
  int scans = 0;
  int alike = 0;
  Frame frame;
  for (int number = 0; number < frames; ++number) {
    if (number % frames_a_buffer == 0) studio.camera->expose();
    ASSERT_EQ(studio.source->next(frame, kPatience), NextStatus::kFrame);
    EXPECT_TRUE(is_part_of(frame, studio.scene.picture.image)) << "frame " << number;
    for (const PolarScan& scan : studio.scanner->process(frame)) {
      ++scans;
      if (largest_difference_m(scan, studio.scene.scan) <= 1e-9) ++alike;
    }
  }
  EXPECT_GE(scans, kPictures - 1) << "a picture a scan; the last one waits for its neighbour";
  // The first one has a dark neighbour on one side only.
  EXPECT_GE(alike, scans - 1);
  EXPECT_EQ(studio.scanner->statistics().unpaired, 0U);
}

// Of fields that come one by one, a fifth is lost and a tenth is flagged as damaged.
TEST(V4l2LostFields, CostTheirOwnScansAndFalsifyNone) {
  constexpr int kFields = 300;
  constexpr std::int64_t kField_ns = 16'683'333;
  Studio studio({"alternate", V4L2_PIX_FMT_GREY, V4L2_FIELD_ALTERNATE});
  std::vector<Frame> frames;
  std::vector<std::uint64_t> scanned;
  double worst_sigmas = 0.0;
  std::uint64_t lost = 0;
  std::uint64_t flagged = 0;
  const auto take = [&](std::span<const PolarScan> scans) {
    for (const PolarScan& scan : scans) {
      scanned.push_back(scan.sequence);
      worst_sigmas = std::max(worst_sigmas, largest_difference_sigmas(scan, studio.scene.scan));
    }
  };
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
    take(studio.scanner->process(frame));
  }
  take(studio.scanner->finish());
  EXPECT_EQ(scanned, pictures_with_a_pair(frames));
  EXPECT_LT(worst_sigmas, 10.0) << "with one dark neighbour instead of two only the noise differs";
  EXPECT_EQ(studio.source->statistics().corrupt, flagged);
  EXPECT_LE(studio.source->statistics().dropped, lost) << "counted in pictures";
  EXPECT_GT(studio.source->statistics().dropped, lost / 2);
}

INSTANTIATE_TEST_SUITE_P(Sent, V4l2Scans, ::testing::ValuesIn(ways_of_television()),
                         [](const auto& way) { return way.param.name; });

}  // namespace
}  // namespace striper::testing
