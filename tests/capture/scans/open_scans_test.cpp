// SPDX-License-Identifier: Apache-2.0
// Proves that a source with a model gives the scans of its Scanner, and recordings the same again.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/scans/open_scans.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>
#include <striper/stream/mcap_recording.hpp>
#include <striper/stream/open_sink.hpp>

#include "support/error_of.hpp"
#include "support/scratch_directory.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;

std::string scene_path() { return testing::source_path("data/scenes/room.yaml").string(); }
std::string source_uri() { return "sim:" + scene_path() + "?frames=3"; }

std::shared_ptr<const StriperModel> model() {
  return std::make_shared<const StriperModel>(Simulator(load_scene(scene_path())).model());
}

std::vector<double> ranges_of(ScanSource& source) {
  std::vector<double> ranges_m;
  PolarScan scan;
  while (source.next(scan, 0ms) == NextStatus::kFrame) {
    EXPECT_EQ(scan.frame->frame_id, "striper_scan0");
    for (const Return& one : scan.returns) {
      if (one.status == ReturnStatus::kOk) ranges_m.push_back(one.range_m);
    }
  }
  return ranges_m;
}

std::vector<double> ranges_of_scanner() {
  const auto source = open_source(source_uri());
  Scanner scanner(*model(), source->info());
  std::vector<double> ranges_m;
  const auto keep = [&](ScanSpan scans) {
    for (const PolarScan& scan : scans) {
      for (const Return& one : scan.returns) {
        if (one.status == ReturnStatus::kOk) ranges_m.push_back(one.range_m);
      }
    }
  };
  source->start();
  for (Frame frame; source->next(frame, 1s) == NextStatus::kFrame;) keep(scanner.process(frame));
  keep(scanner.finish());
  return ranges_m;
}

TEST(OpenScans, SourceWithAModelAndItsRecordingsAreTheSameScans) {
  const std::vector<double> expected = ranges_of_scanner();
  ASSERT_GT(expected.size(), 1000U);
  EXPECT_EQ(ranges_of(*open_scans(source_uri(), model())), expected);

  const testing::ScratchDirectory scratch;
  for (const char* const name : {"a.csv", "a.jsonl"}) {
    const std::string path = (scratch / name).string();
    const auto sink = open_sink(path);
    const auto source = open_scans(source_uri(), model());
    sink->open(source->info());
    PolarScan scan;
    while (source->next(scan, 0ms) == NextStatus::kFrame) sink->write(scan);
    sink->finish();
    EXPECT_EQ(ranges_of(*open_scans(path, nullptr)), expected) << name;
    const auto with_model = open_scans(path, model());
    EXPECT_TRUE(with_model->info().frames.at(0)->T_head_scan.isApprox(
        source->info().frames.at(0)->T_head_scan));
  }
}

// A recording of the frames; with a model attached, or without.
void record_frames(const std::filesystem::path& path,
                   const std::shared_ptr<const StriperModel>& attached) {
  const auto source = open_source(source_uri());
  McapRecording recording(path);
  recording.open(head_info("left", source->info(), attached, StripeAxis::kColumns));
  source->start();
  for (Frame frame; source->next(frame, 1s) == NextStatus::kFrame;) {
    frame.head = "left";
    recording.write(frame);
  }
  recording.close();
}

TEST(OpenScans, FramesOfARecordingAreScannedWithTheAttachedModel) {
  const testing::ScratchDirectory scratch;
  const std::string path = (scratch / "a.mcap").string();
  record_frames(path, model());
  const std::vector<double> expected = ranges_of_scanner();
  for (const std::string& address : {path, "mcap:" + path, "mcap:" + path + "?head=left"}) {
    EXPECT_EQ(ranges_of(*open_scans(address, nullptr)), expected) << address;
    EXPECT_EQ(ranges_of(*open_scans(address, model())), expected) << address;
  }
  const Error error =
      testing::error_of([&] { open_scans("mcap:" + path + "?head=right", nullptr); });
  EXPECT_EQ(error.kind(), ErrorKind::kNotFound);
}

TEST(OpenScans, FramesOfARecordingWithoutAnyModelAreRefused) {
  const testing::ScratchDirectory scratch;
  const std::string path = (scratch / "a.mcap").string();
  record_frames(path, nullptr);
  const Error error = testing::error_of([&] { open_scans(path, nullptr); });
  EXPECT_EQ(error.kind(), ErrorKind::kNotFound);
  EXPECT_THAT(error.what(), ::testing::HasSubstr("frames need a model"));
}

TEST(OpenScans, FramesWithoutAModelAreRefused) {
  const Error error = testing::error_of([] { open_scans(source_uri(), nullptr); });
  EXPECT_EQ(error.kind(), ErrorKind::kUsage);
}

ScannerOptions with_automatic_exposure() {
  ScannerOptions options;
  options.adapts_exposure = true;
  return options;
}

// The simulated room, its exposure set by its own stripe: nine tenths of that are at about half of
// the full scale.
TEST(OpenScans, ExposureIsSetByTheStripe) {
  const auto scans =
      open_scans("sim:" + scene_path() + "?frames=6", model(), with_automatic_exposure());
  PolarScan scan;
  std::vector<double> amplitudes;
  while (scans->next(scan, 0ms) == NextStatus::kFrame) {
    amplitudes.clear();
    for (const Return& one : scan.returns) {
      if (one.status == ReturnStatus::kOk) amplitudes.push_back(one.intensity_dn);
    }
  }
  ASSERT_GT(amplitudes.size(), 450U);
  std::sort(amplitudes.begin(), amplitudes.end());
  EXPECT_NEAR(amplitudes[amplitudes.size() * 9 / 10], 0.45 * 255.0, 0.15 * 255.0);
}

TEST(OpenScans, ExposureOfAFileCannotBeSet) {
  const testing::ScratchDirectory scratch;
  record_frames(scratch / "run.mcap", model());
  const Error error = testing::error_of([&] {
    open_scans("mcap:" + (scratch / "run.mcap").string(), model(), with_automatic_exposure());
  });
  EXPECT_EQ(error.kind(), ErrorKind::kUnsupported);
}

}  // namespace
}  // namespace striper
