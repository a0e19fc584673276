// SPDX-License-Identifier: Apache-2.0
// Proves that what a Recorder wrote is given again frame by frame, every member of it, and that a
// full disk leaves a whole recording. Does not prove that it survives a power failure.
#include <csignal>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <sys/resource.h>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/images/recorder.hpp>

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

std::vector<Frame> replay(const std::filesystem::path& directory, SourceInfo* info = nullptr,
                          const std::string& query = "") {
  const auto source = open_source("images:" + directory.string() + query);
  if (info != nullptr) *info = source->info();
  source->start();
  std::vector<Frame> frames;
  Frame frame;
  while (source->next(frame, 0ms) == NextStatus::kFrame) frames.push_back(frame);
  return frames;
}

void record_and_compare(const std::vector<Frame>& frames, const SourceInfo& info = {}) {
  const ScratchDirectory scratch;
  {
    Recorder recorder(scratch / "rec", info);
    for (const Frame& frame : frames) recorder.write(frame);
    EXPECT_EQ(recorder.frames(), frames.size());
  }
  SourceInfo replayed;
  const std::vector<Frame> again = replay(scratch / "rec", &replayed);
  ASSERT_EQ(again.size(), frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    SCOPED_TRACE(i);
    testing::expect_same_frame(again[i], frames[i]);
  }
  EXPECT_EQ(replayed.pattern, info.pattern);
}

TEST(Recorder, EveryPixelTypeReplaysExactly) {
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3}) {
    SCOPED_TRACE(type);
    record_and_compare({plain_frame(0, type), plain_frame(1, type)});
  }
}

TEST(Recorder, EveryMemberOfAFrameReplaysExactly) {
  std::vector<Frame> frames = testing::full_frames();
  frames[1].time.monotonic_ns = -5;
  SourceInfo info;
  info.pattern = IlluminationPattern::parse("3,dark");
  record_and_compare(frames, info);
}

TEST(Recorder, FieldsReplayExactly) {
  record_and_compare({testing::interlaced_frame()});
  record_and_compare(testing::single_fields());
}

TEST(Recorder, BadFramesKeepTheirReason) { record_and_compare(testing::bad_frames()); }

TEST(Recorder, LostFramesAreCountedAgainOnReplay) {
  const ScratchDirectory scratch;
  {
    Recorder recorder(scratch.path(), {});
    for (const std::uint64_t sequence : {7, 8, 11}) recorder.write(plain_frame(sequence));
  }
  const auto source = open_source("images:" + scratch.path().string());
  EXPECT_EQ(source->info().pictures, 3U);
  EXPECT_NEAR(source->info().picture_rate_hz, 29.97, 0.01);
  source->start();
  Frame frame;
  while (source->next(frame, 0ms) == NextStatus::kFrame) continue;
  EXPECT_EQ(source->statistics().dropped, 2U);
}

TEST(Recorder, AddressOverridesWhatWasRecorded) {
  const ScratchDirectory scratch;
  {
    Recorder recorder(scratch.path(), {});
    Frame frame = plain_frame(0);
    frame.illumination = Illumination::laser(0);
    recorder.write(frame);
  }
  SourceInfo info;
  const std::vector<Frame> frames = replay(scratch.path(), &info, "?laser=dark,1");
  EXPECT_EQ(info.illumination_of(frames.at(0)), Illumination::dark());
  EXPECT_EQ(info.pattern, IlluminationPattern::parse("dark,1"));
}

TEST(Recorder, NeverWritesIntoADirectoryOfImageFiles) {
  const ScratchDirectory scratch;
  { Recorder(scratch.path(), {}).write(plain_frame(0)); }
  const std::string table = testing::read_bytes(scratch / "frames.csv");
  const Error error = testing::error_of([&] { Recorder(scratch.path(), {}); });
  EXPECT_EQ(error.kind(), ErrorKind::kUsage);
  EXPECT_THAT(error.what(), HasSubstr("already holds a recording or image files"));
  EXPECT_EQ(testing::read_bytes(scratch / "frames.csv"), table);
}

TEST(Recorder, WithoutAFrameLeavesADirectoryThatCanBeUsed) {
  const ScratchDirectory scratch;
  { const Recorder unused(scratch.path(), {}); }
  { Recorder(scratch.path(), {}).write(plain_frame(0)); }
  EXPECT_EQ(replay(scratch.path()).size(), 1U);
}

TEST(Recorder, DirectoryThatCannotBeMadeIsAnIoError) {
  const ScratchDirectory scratch;
  testing::write_bytes(scratch / "file", "x");
  const Error error = testing::error_of([&] { Recorder(scratch / "file/rec", {}); });
  EXPECT_EQ(error.kind(), ErrorKind::kIo);
  EXPECT_THAT(error.what(), HasSubstr("file/rec': Not a directory"));
}

// A limit on the size of files stands for a full disk: a write is cut short, then refused.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

// Records until the disk is "full"; returns how many frames went in.
std::size_t record_until_full(const std::filesystem::path& directory, cv::Size size, rlim_t bytes) {
  Recorder recorder(directory, {});
  const FileSizeLimit limit(bytes);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    Frame frame = plain_frame(i);
    // The first is small, so that both an image file and a line can be what does not fit.
    frame.image = draw_noise(CV_8UC1, i == 0 ? cv::Size(4, 4) : size);
    try {
      recorder.write(frame);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kIo);
      EXPECT_THAT(error.what(), HasSubstr("File too large"));
      return i;
    }
  }
  return 1000;
}

TEST(Recorder, FullDiskWithinAnImageFileLeavesAWholeRecording) {
  const ScratchDirectory scratch;
  EXPECT_EQ(record_until_full(scratch.path(), {200, 200}, 2000), 1U);
  EXPECT_EQ(replay(scratch.path()).size(), 1U);
  for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
    EXPECT_NE(entry.path().extension(), ".part");
  }
}

TEST(Recorder, FullDiskWithinALineLeavesWholeLines) {
  const ScratchDirectory scratch;
  const std::size_t written = record_until_full(scratch.path(), {4, 4}, 2000);
  EXPECT_GT(written, 5U);
  EXPECT_LT(written, 1000U);
  EXPECT_TRUE(testing::read_bytes(scratch / "frames.csv").ends_with("\n"));
  EXPECT_EQ(replay(scratch.path()).size(), written);
}

class FrameTable : public ::testing::Test {
 protected:
  FrameTable() { Recorder(scratch_ / "rec", {}).write(plain_frame(0)); }
  void write_table(const std::string& text) {
    testing::write_bytes(scratch_ / "rec" / "frames.csv", text);
  }
  Error error_of_replay() {
    return testing::error_of([&] { replay(scratch_ / "rec"); });
  }
  std::string message_of_replay() {
    const Error error = error_of_replay();
    EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
    return error.what();
  }

  ScratchDirectory scratch_;
};

TEST_F(FrameTable, MayBeWrittenByHandWithFilesAlone) {
  write_table("file,weather\n00000000.png,rain\n00000000.png,\"sun, wind\"");
  const std::vector<Frame> frames = replay(scratch_ / "rec", nullptr, "?fps=10");
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[1].sequence, 1U);
  EXPECT_EQ(frames[1].time.monotonic_ns, 100'000'000);
  EXPECT_EQ(frames[1].sensor_size, cv::Size(40, 30));
}

TEST_F(FrameTable, LastLineCutOffIsLeftOutWithAWarning) {
  const testing::Heard heard;
  write_table("file,sequence\n00000000.png,4\n00000000.pn");
  const auto source = open_source("images:" + (scratch_ / "rec").string(), heard.port());
  EXPECT_EQ(source->info().pictures, 1U);
  ASSERT_EQ(heard.events().size(), 1U);
  EXPECT_EQ(heard.events()[0].code, EventCode("recording_cut"));
  EXPECT_THAT(heard.events()[0].message, HasSubstr("frames.csv' line 3"));
}

TEST_F(FrameTable, EveryMalformedLineIsNamed) {
  write_table("");
  EXPECT_THAT(message_of_replay(), HasSubstr("is empty: no header line"));
  write_table("sequence\n1\n");
  EXPECT_THAT(message_of_replay(), HasSubstr("the header has no column 'file'"));
  write_table("file,sequence\na.png\n");
  EXPECT_THAT(message_of_replay(), HasSubstr("line 2: 1 fields, but the header has 2"));
  write_table("file\n../../etc/a.png\n");
  EXPECT_THAT(message_of_replay(), HasSubstr("line 2: column 'file' cannot be '../../etc/a.png'"));

  const std::vector<std::pair<std::string, std::string>> bad{
      {"sequence", "-1"},
      {"exposure_in_picture", "2"},
      {"exposures_per_picture", "0"},
      {"monotonic_ns", "1.5"},
      {"utc_offset_ns", "noon"},
      {"field_period_ns", ""},
      {"exposure_ns", "x"},
      {"illumination", "bright"},
      {"field", "middle"},
      {"bit_depth", "17"},
      {"sensor_width", "-5"},
      {"sensor_height", "a"},
      {"grid_u_offset", "nan"},
      {"grid_u_step", ""},
      {"grid_v_offset", "inf"},
      {"grid_v_step", "2,"},
      {"cadence", "dark"},
      {"status", "fine"},
      {"grid_u_step", "0"},
      {"grid_v_step", "-2"},
      {"illumination", "64"},
      {"monotonic_ns", "9000000000000000000"},
  };
  for (const auto& [column, value] : bad) {
    write_table(fmt::format("file,{}\na.png,\"{}\"\n", column, value));
    EXPECT_THAT(message_of_replay(),
                HasSubstr(fmt::format("line 2: column '{}' cannot be '{}'", column, value)));
  }
}

TEST_F(FrameTable, WithoutLinesIsNotFound) {
  write_table("file\n");
  const Error error = error_of_replay();
  EXPECT_EQ(error.kind(), ErrorKind::kNotFound);
  EXPECT_THAT(error.what(), HasSubstr("has no frames"));
}

}  // namespace
}  // namespace striper
