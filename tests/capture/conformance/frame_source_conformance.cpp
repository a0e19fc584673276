// SPDX-License-Identifier: Apache-2.0
// Proves of every source of frames what FrameSource promises: numbering, times, fields, stopping
// and starting, two at once, time-outs, counting, lifetime of pixels. Nothing about what the pixels
// show.
#include "capture/conformance/frame_source_conformance.hpp"

#include <atomic>
#include <chrono>
#include <numeric>
#include <thread>
#include <vector>

#include <opencv2/core.hpp>

#include <striper/core/error.hpp>

namespace striper::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr milliseconds kPatience{2000};  // Frames come at 10 a second or more.
constexpr int kFrames = 20;

// A number that changes with any byte of the image (FNV-1a).
std::uint64_t checksum(const cv::Mat& image) {
  std::uint64_t sum = 14695981039346656037ULL;
  for (int row = 0; row < image.rows; ++row) {
    const std::uint8_t* const bytes = image.ptr(row);
    const std::size_t count = static_cast<std::size_t>(image.cols) * image.elemSize();
    for (std::size_t at = 0; at < count; ++at) sum = (sum ^ bytes[at]) * 1099511628211ULL;
  }
  return sum;
}

std::vector<Frame> take(FrameSource& source, int count) {
  std::vector<Frame> frames;
  while (static_cast<int>(frames.size()) < count) {
    Frame frame;
    const NextStatus status = source.next(frame, kPatience);
    EXPECT_EQ(status, NextStatus::kFrame) << "after " << frames.size() << " frames";
    if (status != NextStatus::kFrame) break;
    // Kept as a reader with a long memory would: a copy of its own.
    frame.image = frame.image.clone();
    frame.lease.reset();
    frames.push_back(frame);
  }
  return frames;
}

TEST_P(FrameSourceConformance, SaysWhatItIsOnceItIsOpen) {
  const auto source = GetParam().open();
  const SourceInfo info = source->info();
  EXPECT_FALSE(info.uri.empty());
  EXPECT_FALSE(info.description.empty());
  EXPECT_GT(info.image_size.area(), 0);
  EXPECT_GE(info.sensor_size.width, info.image_size.width);
  EXPECT_GE(info.sensor_size.height, info.image_size.height);
  EXPECT_GE(info.bit_depth, 8);
  EXPECT_LE(info.bit_depth, 16);
  EXPECT_TRUE(info.channels == 1 || info.channels == 3) << info.channels;
  EXPECT_GE(info.picture_rate_hz, 0.0);
}

TEST_P(FrameSourceConformance, GivesNothingBeforeItIsStarted) {
  const auto source = GetParam().open();
  Frame frame;
  EXPECT_EQ(source->next(frame, milliseconds(10)), NextStatus::kStopped);
  EXPECT_EQ(source->statistics().delivered, 0U);
}

TEST_P(FrameSourceConformance, FramesAreWhatItSaidTheyAre) {
  const auto source = GetParam().open();
  source->start();
  const SourceInfo info = source->info();
  for (const Frame& frame : take(*source, kFrames)) {
    ASSERT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    EXPECT_TRUE(frame.status_detail.empty()) << frame.status_detail;
    EXPECT_EQ(frame.image.size(), info.image_size);
    EXPECT_EQ(frame.image.channels(), info.channels);
    EXPECT_EQ(frame.image.depth(), info.bit_depth > 8 ? CV_16U : CV_8U);
    EXPECT_EQ(frame.bit_depth, info.bit_depth);
    EXPECT_EQ(frame.sensor_size, info.sensor_size);
    EXPECT_EQ(frame.time.utc_offset_ns.has_value(), info.has_clock);
    EXPECT_LE(frame.grid.sensor_u(frame.image.cols - 1), info.sensor_size.width - 1);
    EXPECT_LE(frame.grid.sensor_v(frame.image.rows - 1), info.sensor_size.height - 1);
    EXPECT_GE(frame.grid.sensor_v(0), 0.0);
  }
}

TEST_P(FrameSourceConformance, PixelsNeverExceedTheBitDepth) {
  const auto source = GetParam().open();
  source->start();
  for (const Frame& frame : take(*source, 3)) {
    double brightest = 0.0;
    cv::minMaxLoc(frame.image.reshape(1), nullptr, &brightest);
    EXPECT_LE(brightest, frame.full_scale_dn());
  }
}

TEST_P(FrameSourceConformance, NumbersGrowAndEveryGapIsCounted) {
  const auto source = GetParam().open();
  source->start();
  const std::vector<Frame> frames = take(*source, kFrames);
  ASSERT_EQ(frames.size(), static_cast<std::size_t>(kFrames));
  std::uint64_t missing = 0;
  for (std::size_t at = 1; at < frames.size(); ++at) {
    const bool is_interlaced = frames[at].is_interlaced();
    const std::uint64_t before = frames[at - 1].exposure_number();
    const std::uint64_t step = is_interlaced ? 2 : 1;
    ASSERT_GE(frames[at].exposure_number(), before + step) << "frame " << at;
    const std::uint64_t expected = before + step;
    missing += frames[at].exposure_number() - expected;
  }
  const SourceStatistics statistics = source->statistics();
  EXPECT_LE(missing, 2 * (statistics.dropped + statistics.overrun));
  if (missing > 0) {
    EXPECT_GT(statistics.dropped + statistics.overrun, 0U);
  }
}

TEST_P(FrameSourceConformance, TimesGrowAsTheFramesDo) {
  const auto source = GetParam().open();
  source->start();
  const double rate_hz = source->info().picture_rate_hz;
  const std::vector<Frame> frames = take(*source, kFrames);
  ASSERT_GE(frames.size(), 2U);
  for (std::size_t at = 1; at < frames.size(); ++at)
    EXPECT_GT(frames[at].time.monotonic_ns, frames[at - 1].time.monotonic_ns) << "frame " << at;
  if (rate_hz <= 0.0) return;
  const double exposures =
      static_cast<double>(frames.back().exposure_number() - frames.front().exposure_number()) /
      frames.front().exposures_per_picture;
  const double passed_s = 1e-9 * static_cast<double>(frames.back().time.monotonic_ns -
                                                     frames.front().time.monotonic_ns);
  // A live source's stamps may be late by a frame at either end on a busy machine.
  const double slack = source->info().is_live ? 2.5 / rate_hz : 1e-6;
  EXPECT_NEAR(passed_s, exposures / rate_hz, slack);
}

TEST_P(FrameSourceConformance, TimesAreThePresentOrCountFromTheFirstFrame) {
  const auto source = GetParam().open();
  source->start();
  const std::vector<Frame> frames = take(*source, 3);
  const std::int64_t now_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(steady_clock::now().time_since_epoch())
          .count();
  ASSERT_FALSE(frames.empty());
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  if (!source->info().is_live) {
    if (!source->info().has_clock) {
      EXPECT_LT(frames.front().time.monotonic_ns, kSecond_ns);
    }
    return;
  }
  // Some drivers put the end of a frame before it comes: up to a frame ahead is theirs.
  const double rate_hz = source->info().picture_rate_hz;
  const double ahead_s = rate_hz > 0.0 ? 1.0 / rate_hz : 0.1;
  EXPECT_LE(1e-9 * static_cast<double>(frames.back().time.monotonic_ns - now_ns), ahead_s);
  EXPECT_GT(frames.back().time.monotonic_ns, now_ns - 3 * kSecond_ns);
}

TEST_P(FrameSourceConformance, FieldsKeepTheirParityAndPlace) {
  const auto source = GetParam().open();
  source->start();
  const SourceInfo info = source->info();
  int top_place = -1;
  for (const Frame& frame : take(*source, kFrames)) {
    if (frame.field == Field::kProgressive) {
      EXPECT_EQ(frame.exposures_per_picture, 1);
      continue;
    }
    if (frame.is_interlaced()) {
      EXPECT_EQ(frame.field, info.field);
      EXPECT_EQ(frame.exposures_per_picture, 2);
      EXPECT_EQ(frame.exposure_in_picture, 0);
      EXPECT_GT(frame.field_period_ns, 0);
      continue;
    }
    const bool is_top = frame.field == Field::kTop;
    EXPECT_EQ(frame.grid.v.step, 2.0);
    EXPECT_EQ(frame.grid.v.offset, is_top ? 0.0 : 1.0);
    const int top_place_here = is_top ? frame.exposure_in_picture : 1 - frame.exposure_in_picture;
    if (frame.exposures_per_picture == 2) {
      if (top_place < 0) top_place = top_place_here;
      EXPECT_EQ(top_place_here, top_place) << "frame " << frame.sequence;
    }
  }
}

TEST_P(FrameSourceConformance, StopsAndStartsAgain) {
  const auto source = GetParam().open();
  source->start();
  const std::vector<Frame> before = take(*source, 5);
  source->stop();
  Frame frame;
  EXPECT_EQ(source->next(frame, milliseconds(10)), NextStatus::kStopped);
  source->start();
  const std::vector<Frame> after = take(*source, 5);
  ASSERT_EQ(after.size(), before.size());
  EXPECT_EQ(source->statistics().delivered, 5U) << "counts since start";
  if (source->info().is_live) return;
  for (std::size_t at = 0; at < before.size(); ++at) {
    EXPECT_EQ(after[at].sequence, before[at].sequence);
    EXPECT_EQ(after[at].time.monotonic_ns, before[at].time.monotonic_ns);
    EXPECT_EQ(checksum(after[at].image), checksum(before[at].image)) << "frame " << at;
  }
}

TEST_P(FrameSourceConformance, StartingTwiceAndStoppingTwiceDoNothingMore) {
  const auto source = GetParam().open();
  source->stop();
  source->start();
  take(*source, 2);
  source->start();
  EXPECT_EQ(take(*source, 2).size(), 2U);
  EXPECT_EQ(source->statistics().delivered, 4U);
  source->stop();
  source->stop();
  EXPECT_EQ(source->statistics().delivered, 4U) << "readable after stop";
}

TEST_P(FrameSourceConformance, StopEndsAReaderOnAnotherThreadInTime) {
  const auto source = GetParam().open();
  source->start();
  std::atomic<int> read{0};
  NextStatus last = NextStatus::kFrame;
  std::thread reader([&] {
    Frame frame;
    while (last == NextStatus::kFrame) {
      last = source->next(frame, seconds(30));
      ++read;
    }
  });
  while (read == 0) std::this_thread::sleep_for(milliseconds(1));
  const auto asked = steady_clock::now();
  source->stop();
  reader.join();
  EXPECT_LT(steady_clock::now() - asked, seconds(2));
  EXPECT_TRUE(last == NextStatus::kStopped || last == NextStatus::kEnd);
}

TEST_P(FrameSourceConformance, NeverWaitsMuchLongerThanItWasTold) {
  const auto source = GetParam().open();
  source->start();
  const SourceInfo info = source->info();
  const bool may_time_out = info.is_live || info.uri.find("realtime=yes") != std::string::npos;
  Frame frame;
  for (int ask = 0; ask < kFrames; ++ask) {
    const auto asked = steady_clock::now();
    const NextStatus status = source->next(frame, milliseconds(5));
    EXPECT_TRUE(status == NextStatus::kFrame || (may_time_out && status == NextStatus::kTimeout));
    // Files and the simulator time out in real time only: else they take as long as it takes them.
    if (may_time_out) {
      EXPECT_LT(steady_clock::now() - asked, milliseconds(2000)) << "on a busy machine";
    }
  }
}

TEST_P(FrameSourceConformance, CountsWhatItDelivers) {
  const auto source = GetParam().open();
  source->start();
  take(*source, 7);
  const SourceStatistics statistics = source->statistics();
  EXPECT_EQ(statistics.delivered, 7U);
  EXPECT_EQ(statistics.corrupt + statistics.incomplete + statistics.wrong_size, 0U);
  EXPECT_EQ(statistics.reconnects, 0U);
}

TEST_P(FrameSourceConformance, FrameInHandIsNotOverwritten) {
  const auto source = GetParam().open();
  source->start();
  std::vector<Frame> held(3);
  std::vector<std::uint64_t> sums;
  for (Frame& frame : held) {
    ASSERT_EQ(source->next(frame, kPatience), NextStatus::kFrame);
    sums.push_back(checksum(frame.image));
  }
  const Frame copy = held[0];  // Shares the image.
  take(*source, 12);
  ASSERT_EQ(source->next(held[0], kPatience), NextStatus::kFrame) << "handed in with a copy about";
  EXPECT_EQ(checksum(copy.image), sums[0]);
  EXPECT_EQ(checksum(held[1].image), sums[1]);
  EXPECT_EQ(checksum(held[2].image), sums[2]);
}

TEST_P(FrameSourceConformance, ReaderThatKeepsEveryFrameDoesNotStarveIt) {
  const auto source = GetParam().open();
  source->start();
  std::vector<Frame> kept(kFrames);
  for (Frame& frame : kept) ASSERT_EQ(source->next(frame, kPatience), NextStatus::kFrame);
}

TEST_P(FrameSourceConformance, FramesOutliveTheStreamAndTheSource) {
  auto source = GetParam().open();
  source->start();
  std::vector<Frame> kept(3);
  std::vector<std::uint64_t> sums;
  for (Frame& frame : kept) {
    ASSERT_EQ(source->next(frame, kPatience), NextStatus::kFrame);
    sums.push_back(checksum(frame.image));
  }
  source->stop();
  for (std::size_t at = 0; at < kept.size(); ++at) EXPECT_EQ(checksum(kept[at].image), sums[at]);
  source.reset();
  for (std::size_t at = 0; at < kept.size(); ++at) EXPECT_EQ(checksum(kept[at].image), sums[at]);
}

TEST_P(FrameSourceConformance, MayBeDestroyedWhileItStreams) {
  for (int round = 0; round < 3; ++round) {
    const auto source = GetParam().open();
    source->start();
    Frame frame;
    ASSERT_EQ(source->next(frame, kPatience), NextStatus::kFrame);
  }
}

TEST_P(FrameSourceConformance, SecondOneIsServedOrRefusedByName) {
  const auto first = GetParam().open();
  first->start();
  take(*first, 2);
  try {
    const auto second = GetParam().open();
    second->start();
    EXPECT_TRUE(GetParam().can_stream_twice) << "both stream";
    EXPECT_EQ(take(*second, 2).size(), 2U);
  } catch (const Error& error) {
    EXPECT_FALSE(GetParam().can_stream_twice) << error.what();
    EXPECT_EQ(error.kind(), ErrorKind::kDevice);
    EXPECT_NE(std::string(error.what()).find("busy"), std::string::npos) << error.what();
  }
  EXPECT_EQ(take(*first, 3).size(), 3U) << "the first one goes on";
}

TEST_P(FrameSourceConformance, EndIsTheEndAndNothingIsMissing) {
  const auto source = GetParam().open();
  const auto frames = source->info().pictures;
  if (source->info().is_live) {
    EXPECT_FALSE(frames.has_value()) << "nobody knows how many a camera will give";
    return;
  }
  if (!frames || *frames > 1000) return;
  source->start();
  Frame frame;
  std::uint64_t last_frame = 0;
  std::uint64_t count = 0;
  while (source->next(frame, kPatience) == NextStatus::kFrame) {
    last_frame = frame.sequence;
    ++count;
  }
  EXPECT_EQ(source->next(frame, kPatience), NextStatus::kEnd);
  EXPECT_EQ(source->statistics().delivered, count);
  EXPECT_GE(count, *frames);
  EXPECT_GE(last_frame + 1, *frames);
}

}  // namespace
}  // namespace striper::testing
