// SPDX-License-Identifier: Apache-2.0
// Proves that what an MCAP recording keeps of a frame is given again, every member of it; that
// other people's images are taken; and what is said of files that are cut, damaged or hold nothing.
// Does not prove it for every camera: tests/end_to_end does for the simulator.
#include <filesystem>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/stream/mcap_recording.hpp>
#include <striper/wire/cdr.hpp>
#include <striper/wire/mcap_writer.hpp>

#include "support/error_of.hpp"
#include "support/heard.hpp"
#include "support/kept_frames.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;
using testing::draw_noise;
using ::testing::HasSubstr;
using testing::plain_frame;
using testing::ScratchDirectory;

std::vector<Frame> frames_of(FrameSource& source) {
  source.start();
  std::vector<Frame> frames;
  Frame frame;
  while (source.next(frame, 0ms) == NextStatus::kFrame) frames.push_back(frame);
  return frames;
}

std::vector<Frame> replay(const std::filesystem::path& path, const std::string& query = "") {
  return frames_of(*open_source("mcap:" + path.string() + query));
}

void record(const std::filesystem::path& path, const std::vector<Frame>& frames,
            const SourceInfo& source = {}, const std::string& head = "striper") {
  McapRecording recording(path);
  recording.open(head_info(head, source, nullptr, StripeAxis::kColumns));
  for (Frame frame : frames) {
    frame.head = head;
    recording.write(frame);
  }
  recording.close();
}

void record_and_compare(const std::vector<Frame>& frames) {
  const ScratchDirectory scratch;
  record(scratch / "run.mcap", frames);
  const std::vector<Frame> again = replay(scratch / "run.mcap");
  ASSERT_EQ(again.size(), frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    SCOPED_TRACE(i);
    testing::expect_same_frame(again[i], frames[i]);
  }
}

TEST(RecordingSource, EveryPixelTypeReplaysExactly) {
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3}) {
    SCOPED_TRACE(type);
    record_and_compare({plain_frame(0, type), plain_frame(1, type)});
  }
}

TEST(RecordingSource, EveryMemberOfAFrameReplaysExactly) {
  record_and_compare(testing::full_frames());
}

TEST(RecordingSource, FieldsReplayExactly) {
  record_and_compare({testing::interlaced_frame()});
  record_and_compare(testing::single_fields());
}

TEST(RecordingSource, BadFramesKeepTheirReason) { record_and_compare(testing::bad_frames()); }

TEST(RecordingSource, KnowsWhatTheSourceWas) {
  const ScratchDirectory scratch;
  SourceInfo source;
  source.image_size = {40, 30};
  source.sensor_size = {80, 60};
  source.bit_depth = 12;
  source.picture_rate_hz = 30000.0 / 1001.0;
  source.pattern = IlluminationPattern::parse("0,1,dark");
  record(scratch / "run.mcap", {plain_frame(7), plain_frame(8), plain_frame(11)}, source);
  const auto opened = open_source((scratch / "run.mcap").string());
  const SourceInfo info = opened->info();
  EXPECT_EQ(info.image_size, source.image_size);
  EXPECT_EQ(info.sensor_size, source.sensor_size);
  EXPECT_EQ(info.bit_depth, 12);
  EXPECT_EQ(info.picture_rate_hz, source.picture_rate_hz);
  EXPECT_EQ(info.pattern, source.pattern);
  EXPECT_EQ(info.pictures, 3U);
  EXPECT_FALSE(info.is_live);
  frames_of(*opened);
  EXPECT_EQ(opened->statistics().dropped, 2U);
}

TEST(RecordingSource, OfSeveralHeadsOneHasToBeNamed) {
  const ScratchDirectory scratch;
  const std::filesystem::path path = scratch / "run.mcap";
  {
    McapRecording recording(path);
    for (const char* head : {"left", "right"}) {
      recording.open(head_info(head, {}, nullptr, StripeAxis::kColumns));
    }
    for (const char* head : {"left", "right", "left"}) {
      Frame frame = plain_frame(head[0] == 'l' ? 1 : 2);
      frame.head = head;
      recording.write(frame);
    }
    recording.close();
  }
  EXPECT_EQ(replay(path, "?head=left").size(), 2U);
  EXPECT_EQ(replay(path, "?head=right").size(), 1U);
  const Error several = testing::error_of([&] { replay(path); });
  EXPECT_EQ(several.kind(), ErrorKind::kUsage);
  EXPECT_THAT(several.what(), HasSubstr("frames of left, right: name one with ?head="));
  const Error none = testing::error_of([&] { replay(path, "?head=up"); });
  EXPECT_EQ(none.kind(), ErrorKind::kNotFound);
}

// As rosbag2 keeps a camera: no FrameInfo, a colour order that is not ours.
TEST(RecordingSource, TakesOtherPeoplesImages) {
  const ScratchDirectory scratch;
  const std::filesystem::path path = scratch / "drive.mcap";
  wire::McapWriter writer(path);
  const auto channel =
      writer.add_channel(wire::ros_channel("/camera/image", wire::schema_of<wire::Image>()));
  wire::Image image;
  image.width = 2;
  image.height = 1;
  image.step = 8;  // With two bytes that are nothing.
  image.encoding = "rgb8";
  image.data = {1, 2, 3, 4, 5, 6, 99, 99};
  for (std::uint32_t i = 0; i < 3; ++i) {
    if (i == 2) image.encoding = "yuv422";
    image.header.stamp = {1'700'000'000, i * 50'000'000};
    std::vector<std::uint8_t> bytes;
    wire::write_cdr(image, bytes);
    writer.write({channel, i, 5 + i, 5 + i, bytes});
  }
  writer.close();
  const std::vector<Frame> frames = replay(path);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].image.at<cv::Vec3b>(0, 1), cv::Vec3b(6, 5, 4));
  EXPECT_EQ(frames[1].sequence, 1U);
  EXPECT_EQ(frames[1].time.monotonic_ns, 1'700'000'000'050'000'000);
  EXPECT_EQ(frames[1].sensor_size, cv::Size(2, 1));
  EXPECT_EQ(frames[2].status, FrameStatus::kCorrupt);
  EXPECT_THAT(frames[2].status_detail, HasSubstr("'yuv422'"));
}

// Cut at every 97th byte: whole frames come, each with its own image, and the loss is said.
TEST(RecordingSource, ReadsACutFileToItsLastWholeChunk) {
  const ScratchDirectory scratch;
  const std::filesystem::path path = scratch / "run.mcap";
  std::vector<Frame> frames;
  for (std::uint64_t i = 0; i < 40; ++i) frames.push_back(plain_frame(i));
  record(path, frames);
  const std::string bytes = testing::read_bytes(path);
  std::size_t most = 0;
  for (std::size_t size = 0; size < bytes.size(); size += 97) {
    testing::write_bytes(scratch / "cut.mcap", bytes.substr(0, size));
    testing::Heard heard;
    try {
      const auto source = open_source("mcap:" + (scratch / "cut.mcap").string(), heard.port());
      const std::vector<Frame> read = frames_of(*source);
      most = std::max(most, read.size());
      for (std::size_t i = 0; i < read.size(); ++i) testing::expect_same_frame(read[i], frames[i]);
      EXPECT_EQ(heard.events().size(), 1U) << size;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("cut.mcap")) << size;
    }
  }
  EXPECT_EQ(most, frames.size());
  testing::write_bytes(scratch / "cut.mcap", bytes.substr(0, 150));
  EXPECT_THAT(testing::error_of([&] { replay(scratch / "cut.mcap"); }).what(),
              HasSubstr("holds no images: it was cut off before its first message"));
}

TEST(RecordingSource, SaysWhatIsNoRecordingOfFrames) {
  const ScratchDirectory scratch;
  testing::write_bytes(scratch / "text.mcap", "frame,time_s\n");
  EXPECT_EQ(testing::error_of([&] { replay(scratch / "text.mcap"); }).kind(), ErrorKind::kBadFile);
  EXPECT_EQ(testing::error_of([&] { replay(scratch / "none.mcap"); }).kind(), ErrorKind::kNotFound);
  record(scratch / "empty.mcap", {});
  const Error error = testing::error_of([&] { replay(scratch / "empty.mcap"); });
  EXPECT_EQ(error.kind(), ErrorKind::kNotFound);
  EXPECT_THAT(error.what(), HasSubstr("holds no images"));
  EXPECT_EQ(testing::error_of([&] { replay(scratch / "empty.mcap", "?heed=a"); }).kind(),
            ErrorKind::kUsage);
}

TEST(RecordingSource, RealtimeGivesFramesNoSoonerThanTheyWereRecorded) {
  const ScratchDirectory scratch;
  record(scratch / "run.mcap", {plain_frame(0), plain_frame(1), plain_frame(4)});
  const auto source = open_source((scratch / "run.mcap?realtime=yes").string());
  source->start();
  const auto begin = std::chrono::steady_clock::now();
  Frame frame;
  NextStatus status = NextStatus::kTimeout;
  int timeouts = 0;
  while ((status = source->next(frame, 20ms)) != NextStatus::kEnd) {
    timeouts += status == NextStatus::kTimeout ? 1 : 0;
  }
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 133ms);
  EXPECT_GE(timeouts, 2);  // Between 33 and 133 ms.
  EXPECT_EQ(source->statistics().delivered, 3U);
}

}  // namespace
}  // namespace striper
