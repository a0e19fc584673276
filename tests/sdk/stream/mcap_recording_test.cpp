// SPDX-License-Identifier: Apache-2.0
// Proves what a recording holds: models that come back, a topic per message and head, an image in
// front of what it is, each file of a series standing alone, events kept until the file is there.
// That the same scans come back is scan_files_test's business, that frames do mcap_source_test's.
#include <map>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/stream/mcap_recording.hpp>
#include <striper/stream/open_sink.hpp>
#include <striper/stream/scan_files.hpp>

#include "support/error_of.hpp"
#include "support/made_scans.hpp"
#include "support/mcap_files.hpp"
#include "support/models.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

HeadInfo head_of(const char* name) {
  const auto model = std::make_shared<const StriperModel>(testing::typical_model());
  SourceInfo source;
  source.has_clock = true;
  return head_info(name, source, model, StripeAxis::kColumns);
}

std::map<std::string, int> topics_of(const std::filesystem::path& path) {
  std::map<std::string, int> topics;
  for (const auto& message : testing::read_mcap(path).messages) ++topics[message.topic];
  return topics;
}

PolarScan scan_of(const HeadInfo& head, std::uint64_t sequence) {
  PolarScan scan = testing::made_scan(sequence);
  scan.frame = head.frames.front();
  return scan;
}

TEST(McapRecording, HasATopicForEveryMessageOfEveryHead) {
  testing::reseed();
  const testing::ScratchDirectory scratch;
  const HeadInfo left = head_of("left");
  const HeadInfo right = head_of("right");
  McapRecording recording(scratch / "a.mcap");
  Event early("source_opened", "it is there");
  early.head = "left";
  early.time_s = 1.76e9;
  recording.write(early);
  recording.open(left);
  recording.open(right);
  for (std::uint64_t n = 0; n < 3; ++n) {
    recording.write(scan_of(left, n));
    recording.write(scan_of(right, n));
  }
  ScannerStatus status;
  status.head = "left";
  recording.write(status);
  recording.close();
  const std::map<std::string, int> expected = {
      {"/left/events", 1}, {"/left/polar_scan", 3}, {"/left/points", 3},
      {"/left/scan", 3},   {"/right/points", 3},    {"/right/polar_scan", 3},
      {"/right/scan", 3},  {"/tf_static", 1},       {"/diagnostics", 1}};
  EXPECT_EQ(topics_of(scratch / "a.mcap"), expected);
}

TEST(McapRecording, ScansComeBackInTheFramesOfTheirModel) {
  testing::reseed();
  const testing::ScratchDirectory scratch;
  const HeadInfo left = head_of("left");
  const HeadInfo right = head_of("right");
  McapRecording recording(scratch / "a.mcap");
  recording.open(left);
  recording.open(right);
  recording.write(scan_of(left, 0));
  recording.write(scan_of(right, 1));
  recording.close();
  const auto source = read_mcap_scans(scratch / "a.mcap");
  EXPECT_EQ(source->info().head, "left");
  ASSERT_NE(source->info().model, nullptr);
  PolarScan scan;
  for (const HeadInfo* head : {&left, &right}) {
    ASSERT_EQ(source->next(scan, {}), NextStatus::kFrame);
    EXPECT_EQ(scan.head(), head->head);
    EXPECT_EQ(scan.frame->frame_id, head->frames.front()->frame_id);
    EXPECT_TRUE(scan.frame->T_head_scan.isApprox(head->frames.front()->T_head_scan, 1e-15));
  }
  EXPECT_EQ(source->next(scan, {}), NextStatus::kEnd);

  const auto one = read_mcap_scans(scratch / "a.mcap", nullptr, "right");
  ASSERT_EQ(one->next(scan, {}), NextStatus::kFrame);
  EXPECT_EQ(scan.sequence, 1U);
  EXPECT_EQ(one->next(scan, {}), NextStatus::kEnd);
}

TEST(McapRecording, FileWithoutScansIsNoneOfScans) {
  const testing::ScratchDirectory scratch;
  McapRecording recording(scratch / "a.mcap");
  recording.open(head_of("left"));
  recording.close();
  EXPECT_EQ(testing::error_of([&] { read_mcap_scans(scratch / "a.mcap"); }).kind(),
            ErrorKind::kNotFound);
}

TEST(McapRecording, ImageStandsInFrontOfItsInfo) {
  const testing::ScratchDirectory scratch;
  McapRecording recording(scratch / "a.mcap");
  recording.open(head_of("striper"));
  Frame frame;
  frame.image = cv::Mat(4, 6, CV_16UC1, cv::Scalar(700));
  recording.write(frame);
  frame.image.release();
  frame.status = FrameStatus::kCorrupt;
  frame.sequence = 1;
  recording.write(frame);
  recording.close();
  std::vector<std::string> topics;
  for (const auto& message : testing::read_mcap(scratch / "a.mcap").messages) {
    topics.push_back(message.topic);
  }
  EXPECT_EQ(topics,
            (std::vector<std::string>{"/tf_static", "/striper/camera_info", "/striper/image_raw",
                                      "/striper/frame_info", "/striper/frame_info"}));
}

TEST(McapRecording, EachFileOfASeriesStandsAlone) {
  testing::reseed();
  const testing::ScratchDirectory scratch;
  const HeadInfo head = head_of("striper");
  const auto sink = open_sink((scratch / "run.mcap").string() + "?rotate=200kB");
  sink->open(head);
  for (std::uint64_t n = 0; n < 100; ++n) sink->write(scan_of(head, n));
  sink->finish();
  std::uint64_t scans = 0;
  int files = 0;
  for (;; ++files) {
    const auto path = scratch / ("run_000" + std::to_string(files) + ".mcap");
    if (!std::filesystem::exists(path)) break;
    EXPECT_EQ(topics_of(path)["/tf_static"], 1);
    const auto source = read_mcap_scans(path);
    EXPECT_NE(source->info().model, nullptr);
    for (PolarScan scan; source->next(scan, {}) == NextStatus::kFrame;) {
      EXPECT_EQ(scan.sequence, scans++);
    }
  }
  EXPECT_EQ(scans, 100U);
  EXPECT_GT(files, 1);
}

}  // namespace
}  // namespace striper
