// SPDX-License-Identifier: Apache-2.0
// Proves what `images:` makes of a directory: numbers and times, the keys of its address, and that
// a bad image file is a frame with its reason, counted, and not the end. Recordings:
// recorder_test.cpp.
#include <array>
#include <deque>
#include <mutex>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/images/image_source.hpp>

#include "support/error_of.hpp"
#include "support/heard.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ScratchDirectory;
using ::testing::StartsWith;

class ImagesOfADirectory : public ::testing::Test {
 protected:
  // An image file whose every pixel is `value`.
  void put(const std::string& name, int value = 7, int type = CV_8UC1, cv::Size size = {32, 24}) {
    const cv::Mat image(size, type, cv::Scalar::all(value));
    ASSERT_TRUE(cv::imwrite((scratch_ / name).string(), image));
  }
  void cut_in_half(const std::string& name) {
    const std::string bytes = testing::read_bytes(scratch_ / name);
    testing::write_bytes(scratch_ / name, bytes.substr(0, bytes.size() / 2));
  }
  std::unique_ptr<FrameSource> open(const std::string& query = "") {
    return open_source("images:" + scratch_.path().string() + query, heard_.port());
  }
  std::vector<Frame> read_all(FrameSource& source) {
    std::vector<Frame> frames;
    source.start();
    Frame frame;
    while (source.next(frame, 0ms) == NextStatus::kFrame) frames.push_back(frame);
    source.stop();
    return frames;
  }
  std::vector<Frame> read_all(const std::string& query = "") { return read_all(*open(query)); }
  Error error_of(const std::string& query) {
    return testing::error_of([&] { open(query); });
  }

  ScratchDirectory scratch_;
  testing::Heard heard_;
};

TEST_F(ImagesOfADirectory, AreNumberedAndTimedInNaturalOrder) {
  put("shot10.png", 10);
  put("shot2.png", 2);
  put("shot1.png", 1);
  const std::vector<Frame> frames = read_all("?fps=8");
  ASSERT_EQ(frames.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(frames[i].sequence, i);
    EXPECT_EQ(frames[i].time.monotonic_ns, static_cast<std::int64_t>(i) * 125'000'000);
    EXPECT_FALSE(frames[i].time.utc_offset_ns.has_value());
    EXPECT_EQ(frames[i].status, FrameStatus::kOk);
    EXPECT_EQ(frames[i].sensor_size, cv::Size(32, 24));
    EXPECT_EQ(frames[i].grid, PixelGrid());
    EXPECT_TRUE(frames[i].illumination.is_unknown());
  }
  EXPECT_EQ(frames[2].image.at<std::uint8_t>(0, 0), 10);
}

class NumbersInNames : public ImagesOfADirectory {
 protected:
  std::vector<std::uint64_t> numbers_of(const std::vector<std::string>& names) {
    for (const std::string& name : names) put(name);
    std::vector<std::uint64_t> numbers;
    for (const Frame& frame : read_all("?fps=10")) {
      numbers.push_back(frame.sequence);
      EXPECT_EQ(frame.time.monotonic_ns, static_cast<std::int64_t>(frame.sequence) * 100'000'000);
    }
    return numbers;
  }
};
using Numbers = std::vector<std::uint64_t>;

TEST_F(NumbersInNames, TellWhichFramesAreLost) {
  EXPECT_EQ(numbers_of({"shot_007.png", "shot_008.png", "shot_010.png", "shot_011.png",
                        "shot_012.png", "shot_013.png"}),
            (Numbers{0, 1, 3, 4, 5, 6}));
  const auto source = open();
  read_all(*source);
  EXPECT_EQ(source->statistics().dropped, 1U);
}

TEST_F(NumbersInNames, CountInTheirOwnStep) {
  EXPECT_EQ(numbers_of({"a20_left.png", "a30_left.png", "a40_left.png", "a70_left.png",
                        "a80_left.png", "a90_left.png", "a100_left.png"}),
            (Numbers{0, 1, 2, 5, 6, 7, 8}));
}

TEST_F(NumbersInNames, GoOnAcrossALongGap) {
  EXPECT_EQ(numbers_of({"m1.png", "m2.png", "m3.png", "m8.png", "m9.png", "m10.png"}),
            (Numbers{0, 1, 2, 7, 8, 9}));
}

// Where fewer than half have a neighbour nobody can tell whether they count frames.
TEST_F(NumbersInNames, OfWhichMostNeighboursAreMissingAreNone) {
  EXPECT_EQ(numbers_of({"n1.png", "n3.png", "n4.png", "n7.png", "n8.png", "n11.png"}),
            (Numbers{0, 1, 2, 3, 4, 5}));
}

TEST_F(NumbersInNames, ThatAreChosenImagesOrTimesAreNone) {
  EXPECT_EQ(numbers_of({"p1.png", "p7.png", "p19.png", "p23.png", "p24.png", "p100.png"}),
            (Numbers{0, 1, 2, 3, 4, 5}));
}

TEST_F(NumbersInNames, OfAFewFilesAreNone) {
  EXPECT_EQ(numbers_of({"f1.png", "f2.png", "f3.png", "f10.png"}), (Numbers{0, 1, 2, 3}));
}

TEST_F(NumbersInNames, BesideOtherNamesAreNone) {
  EXPECT_EQ(numbers_of({"b1.png", "b2.png", "b4.png", "b5.png", "b6.png", "c7.png"}),
            (Numbers{0, 1, 2, 3, 4, 5}));
}

TEST_F(ImagesOfADirectory, InfoSaysWhatTheFirstImageIs) {
  put("a.png", 7, CV_16UC3, {20, 10});
  put("b.png", 7, CV_16UC3, {20, 10});
  const SourceInfo info = open("?bits=12&fps=5&laser=0,dark")->info();
  EXPECT_EQ(info.image_size, cv::Size(20, 10));
  EXPECT_EQ(info.sensor_size, cv::Size(20, 10));
  EXPECT_EQ(info.bit_depth, 12);
  EXPECT_EQ(info.channels, 3);
  EXPECT_EQ(info.pictures, 2U);
  EXPECT_EQ(info.picture_rate_hz, 5.0);
  EXPECT_FALSE(info.is_live);
  EXPECT_FALSE(info.has_clock);
  EXPECT_EQ(info.pattern, IlluminationPattern::parse("0,dark"));
  EXPECT_THAT(info.description, HasSubstr("2 frames of '"));
}

TEST_F(ImagesOfADirectory, TruncatedImageFileIsACorruptFrameAndNotTheEnd) {
  put("1.jpg");
  put("2.jpg");
  put("3.jpg");
  cut_in_half("2.jpg");
  const auto source = open();
  const std::vector<Frame> frames = read_all(*source);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].status, FrameStatus::kOk);
  EXPECT_EQ(frames[1].status, FrameStatus::kCorrupt);
  EXPECT_THAT(frames[1].status_detail, HasSubstr("2.jpg' is a damaged or truncated JPEG"));
  EXPECT_TRUE(frames[1].image.empty());
  EXPECT_EQ(frames[1].sequence, 1U);
  EXPECT_EQ(frames[2].status, FrameStatus::kOk);
  EXPECT_EQ(frames[2].status_detail, "");
  EXPECT_EQ(source->statistics().delivered, 3U);
  EXPECT_EQ(source->statistics().corrupt, 1U);
}

TEST_F(ImagesOfADirectory, FirstImageCorruptLeavesTheSizeToTheNext) {
  put("1.png");
  put("2.png");
  cut_in_half("1.png");
  const auto source = open();
  EXPECT_EQ(source->info().image_size, cv::Size(32, 24));
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(frames.at(0).status, FrameStatus::kCorrupt);
  EXPECT_EQ(frames.at(1).status, FrameStatus::kOk);
}

TEST_F(ImagesOfADirectory, NoImageThatDecodesIsStillAStreamOfReasons) {
  put("1.png");
  cut_in_half("1.png");
  const auto source = open();
  EXPECT_EQ(source->info().image_size, cv::Size());
  EXPECT_EQ(read_all(*source).at(0).status, FrameStatus::kCorrupt);
}

TEST_F(ImagesOfADirectory, AnotherSizeOrTypeThanTheFirstIsWrongSize) {
  put("1.png");
  put("2.png", 7, CV_8UC1, {24, 32});
  put("3.png", 7, CV_8UC3);
  put("4.png", 7, CV_16UC1);
  put("5.png");
  const auto source = open();
  const std::vector<Frame> frames = read_all(*source);
  ASSERT_EQ(frames.size(), 5U);
  EXPECT_EQ(frames[1].status, FrameStatus::kWrongSize);
  EXPECT_THAT(frames[1].status_detail,
              HasSubstr("2.png' is 24x32 grey of 8 bits, but the first one is 32x24 grey"));
  EXPECT_EQ(frames[2].status, FrameStatus::kWrongSize);
  EXPECT_EQ(frames[3].status, FrameStatus::kWrongSize);
  EXPECT_EQ(frames[4].status, FrameStatus::kOk);
  EXPECT_EQ(source->statistics().wrong_size, 3U);
}

TEST_F(ImagesOfADirectory, ImageFileThatVanishesMeanwhileIsACorruptFrame) {
  put("1.png");
  put("2.png");
  const auto source = open();
  std::filesystem::remove(scratch_ / "2.png");
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(frames.at(1).status, FrameStatus::kCorrupt);
  EXPECT_THAT(frames.at(1).status_detail, HasSubstr("2.png': No such file"));
}

TEST_F(ImagesOfADirectory, StartAgainBeginsWithTheFirstAndStopEndsTheWait) {
  put("1.png");
  put("2.png");
  const auto source = open();
  Frame frame;
  EXPECT_EQ(source->next(frame, 0ms), NextStatus::kStopped) << "before start";
  EXPECT_EQ(read_all(*source).size(), 2U);
  EXPECT_EQ(read_all(*source).size(), 2U);
  EXPECT_EQ(source->statistics().delivered, 2U) << "counts since start";
  source->start();
  ASSERT_EQ(source->next(frame, 0ms), NextStatus::kFrame);
  EXPECT_EQ(frame.sequence, 0U);
  source->stop();
  EXPECT_EQ(source->next(frame, 0ms), NextStatus::kStopped);
}

TEST_F(ImagesOfADirectory, FrameHandedInIsReusedOnlyIfNobodyElseHoldsIt) {
  put("1.png", 1);
  put("2.png", 2);
  put("3.png", 3);
  const auto source = open();
  source->start();
  Frame frame;
  source->next(frame, 0ms);
  const cv::Mat kept = frame.image;
  source->next(frame, 0ms);
  EXPECT_EQ(kept.at<std::uint8_t>(0, 0), 1) << "what the caller kept was overwritten";
  const void* const memory = frame.image.data;
  source->next(frame, 0ms);
  EXPECT_EQ(frame.image.data, memory);
  EXPECT_EQ(frame.image.at<std::uint8_t>(0, 0), 3);
}

// Another thread looks at each frame while the next ones are read into the same variable; the
// ThreadSanitizer sees more than the values do.
TEST_F(ImagesOfADirectory, FrameInAnotherThreadIsNeverWrittenTo) {
  constexpr int kImages = 60;
  for (int i = 0; i < kImages; ++i) put(std::to_string(i) + ".png", i);
  std::mutex mutex;
  std::deque<Frame> handed_over;
  bool is_done = false;
  int wrong = 0;
  std::thread reader([&] {
    while (true) {
      Frame frame;
      {
        const std::lock_guard lock(mutex);
        if (handed_over.empty() && is_done) return;
        if (handed_over.empty()) continue;
        std::swap(frame, handed_over.front());
        handed_over.pop_front();
      }
      const cv::Mat expected(frame.image.size(), CV_8UC1, cv::Scalar(frame.sequence));
      wrong += cv::countNonZero(frame.image != expected) == 0 ? 0 : 1;
    }
  });
  const auto source = open();
  source->start();
  Frame frame;
  while (source->next(frame, 0ms) == NextStatus::kFrame) {
    const std::lock_guard lock(mutex);
    handed_over.push_back(frame);
  }
  {
    const std::lock_guard lock(mutex);
    is_done = true;
  }
  reader.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(ImagesOfADirectory, PatternOfTheAddressIsTheSourcesAndNoFrames) {
  for (const char* name : {"1.png", "2.png", "3.png", "4.png"}) put(name);
  const std::vector<Frame> frames = read_all("?laser=0,1,dark");
  const SourceInfo info = open("?laser=0,1,dark")->info();
  const std::array expected{Illumination::laser(0), Illumination::laser(1), Illumination::dark(),
                            Illumination::laser(0)};
  for (std::size_t n = 0; n < expected.size(); ++n) {
    EXPECT_TRUE(frames.at(n).illumination.is_unknown()) << "it was said, and nobody knows";
    EXPECT_EQ(info.illumination_of(frames.at(n)), expected.at(n));
  }
}

TEST_F(ImagesOfADirectory, FieldsOfTheAddressMakeInterlacedFrames) {
  put("1.png");
  put("2.png");
  const auto source = open("?fields=split-bottom&laser=0,dark&fps=25");
  EXPECT_EQ(source->info().field, Field::kInterlacedBottomFirst);
  const std::vector<Frame> frames = read_all(*source);
  EXPECT_EQ(frames.at(1).field, Field::kInterlacedBottomFirst);
  EXPECT_EQ(frames.at(1).exposures_per_picture, 2);
  EXPECT_EQ(frames.at(1).exposure_number(), 2U);
  EXPECT_EQ(frames.at(1).field_period_ns, 20'000'000);
  EXPECT_TRUE(source->info().illumination_of(frames.at(1)).is_unknown())
      << "its two fields are lit differently";
  const SourceInfo always = open("?fields=split-top&laser=0")->info();
  EXPECT_EQ(always.illumination_of(frames.at(1)), Illumination::laser(0));
}

TEST_F(ImagesOfADirectory, WrongKeysAndValuesAreUsageErrors) {
  put("1.png");
  EXPECT_THAT(error_of("?fsp=3").what(), HasSubstr("images: knows fps, bits, laser, fields"));
  EXPECT_THAT(error_of("?fields=top").what(), HasSubstr("expected split-top or split-bottom"));
  EXPECT_THAT(error_of("?laser=0,off").what(),
              AllOf(StartsWith("source 'images:"), HasSubstr("?laser=0,off': illumination pattern"),
                    HasSubstr("'off' is neither")));
  EXPECT_THAT(error_of("?laser=dark").what(),
              HasSubstr("?laser=dark': an illumination pattern needs"));
  EXPECT_THAT(error_of("?fps=0").what(), HasSubstr("fps=0"));
  EXPECT_THAT(error_of("?bits=12").what(), HasSubstr("bits=12 - but '"));
  for (const char* query : {"?fsp=3", "?fields=top", "?laser=0,off", "?fps=0", "?bits=12"}) {
    EXPECT_EQ(error_of(query).kind(), ErrorKind::kUsage) << query;
  }
}

TEST_F(ImagesOfADirectory, BitsThatAPixelExceedsAreRefused) {
  put("1.png", 4096, CV_16UC1);
  EXPECT_THAT(error_of("?bits=12").what(), HasSubstr("grey of 16 bits with values up to 4096"));
  EXPECT_EQ(read_all("?bits=13").at(0).bit_depth, 13);
  EXPECT_EQ(read_all().at(0).bit_depth, 16);
}

TEST_F(ImagesOfADirectory, WordsThatAreNeverFilledAreWarnedOf) {
  put("1.png", 4096, CV_16UC1);
  read_all();
  EXPECT_THAT(heard_.events(), IsEmpty());
  put("1.png", 4095, CV_16UC1);
  read_all("?bits=12");
  EXPECT_THAT(heard_.events(), IsEmpty());
  read_all();
  ASSERT_EQ(heard_.events().size(), 1U);
  EXPECT_EQ(heard_.events()[0].code, EventCode("bits_unknown"));
  EXPECT_THAT(heard_.events()[0].message, HasSubstr("1.png"));
}

TEST_F(ImagesOfADirectory, EmptyOrMissingDirectoryIsNotFound) {
  EXPECT_EQ(error_of("").kind(), ErrorKind::kNotFound);
  EXPECT_EQ(error_of("/none").kind(), ErrorKind::kNotFound);
}

}  // namespace
}  // namespace striper
