// SPDX-License-Identifier: Apache-2.0
// Proves that the GigE source works with a camera that is not ours: the fake one of Aravis
// (arv-fake-gv-camera-0.8 runs the same), over real packets on loopback. It has few features and
// neither resend nor strobe: those are proved with the virtual camera.
#include <atomic>
#include <chrono>
#include <filesystem>

#include <arv.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>

#include "capture/gige/taken_pictures.hpp"
#include "support/error_of.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr const char* kSerial = "STRIPERFAKE";

/// The fake camera is always at 127.0.0.1, so there can be one on a machine at a time.
class AravisFakeCamera : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto lock = std::filesystem::temp_directory_path() / "striper-aravis-fake-camera.lock";
    lock_ = open(lock.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    ASSERT_EQ(flock(lock_, LOCK_EX), 0);
    camera_ = arv_gv_fake_camera_new("lo", kSerial);
    ASSERT_TRUE(arv_gv_fake_camera_is_running(camera_));
  }
  void TearDown() override {
    if (camera_ != nullptr) g_object_unref(camera_);
    close(lock_);
  }

  static std::string refusal(const std::string& query) {
    return testing::error_of([&] { open_source("gige:127.0.0.1?" + query); }).what();
  }

  int lock_ = -1;
  ArvGvFakeCamera* camera_ = nullptr;
};

TEST_F(AravisFakeCamera, IsFoundBySerialAndStreams) {
  const auto source = open_source(std::string("gige:") + kSerial + "?fps=50&exposure_us=1000");
  const SourceInfo info = source->info();
  EXPECT_THAT(info.description, HasSubstr(kSerial));
  EXPECT_EQ(info.sensor_size, cv::Size(2048, 2048));
  EXPECT_NEAR(info.picture_rate_hz, 50.0, 0.1);
  source->start();
  Frame frame;
  std::int64_t last_ns = 0;
  for (std::uint64_t n = 0; n < 10; ++n) {
    ASSERT_EQ(source->next(frame, 2000ms), NextStatus::kFrame);
    EXPECT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
    EXPECT_EQ(frame.sequence, n);
    EXPECT_EQ(frame.image.size(), info.image_size);
    EXPECT_EQ(frame.exposure_ns, 1'000'000);
    EXPECT_GT(frame.time.monotonic_ns, last_ns);
    last_ns = frame.time.monotonic_ns;
  }
  source->stop();
  EXPECT_EQ(source->next(frame, 10ms), NextStatus::kStopped);
  EXPECT_EQ(source->statistics().delivered, 10u);
}

TEST_F(AravisFakeCamera, RegionAndPixelFormatAreSet) {
  const auto source = open_source("gige:127.0.0.1?roi=16,32,320,240&pixel_format=Mono16&fps=50");
  EXPECT_EQ(source->info().bit_depth, 16);
  source->start();
  Frame frame;
  ASSERT_EQ(source->next(frame, 2000ms), NextStatus::kFrame);
  EXPECT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
  EXPECT_EQ(frame.image.size(), cv::Size(320, 240));
  EXPECT_EQ(frame.image.type(), CV_16UC1);
  EXPECT_EQ(frame.grid, PixelGrid::region(16, 32));
}

/// An image whose every pixel follows from its first.
void fill_counted(ArvBuffer* buffer, void* count, guint32, guint32, ArvPixelFormat) {
  const auto first = static_cast<unsigned>(++*static_cast<std::atomic<unsigned>*>(count));
  const int width = arv_buffer_get_image_width(buffer);
  const int height = arv_buffer_get_image_height(buffer);
  // What it says of its size is what was received: nothing yet.
  auto* const pixels =
      static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, nullptr)));
  const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (std::size_t i = 0; i < size; ++i) {
    const auto u = static_cast<unsigned>(i % static_cast<std::size_t>(width));
    const auto v = static_cast<unsigned>(i / static_cast<std::size_t>(width));
    pixels[i] = static_cast<std::uint8_t>(first + u + 3 * v);
  }
}

bool is_whole(const cv::Mat& image) {
  const unsigned first = image.at<std::uint8_t>(0, 0);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const unsigned expected = first + static_cast<unsigned>(u) + 3 * static_cast<unsigned>(v);
      if (image.at<std::uint8_t>(v, u) != static_cast<std::uint8_t>(expected)) return false;
    }
  }
  return true;
}

TEST_F(AravisFakeCamera, FramesThatLostPacketsAreCountedAndThoseDeliveredAreExact) {
  static std::atomic<unsigned> count = 0;  // Static: the camera's thread may outlive this function.
  ArvFakeCamera* const inside = arv_gv_fake_camera_get_fake_camera(camera_);
  arv_fake_camera_set_fill_pattern(inside, fill_counted, &count);
  for (const double ratio : {0.001, 0.01, 0.05}) {
    g_object_set(camera_, "gvsp-lost-ratio", ratio, nullptr);
    const auto source = open_source("gige:127.0.0.1?roi=0,0,320,240&fps=100&packet_size=1400");
    SCOPED_TRACE(::testing::Message() << "loss " << ratio);
    source->start();
    const auto taken =
        testing::take_frames(*source, 50, [](const Frame& frame) { return is_whole(frame.image); });
    source->stop();
    const SourceStatistics got = source->statistics();
    taken.expect_accounted_for(got);
    if (ratio >= 0.01) {
      EXPECT_GT(got.incomplete + got.dropped, 0u);
    }
  }
  g_object_set(camera_, "gvsp-lost-ratio", 0.0, nullptr);
}

TEST_F(AravisFakeCamera, WhatItCannotDoIsRefusedWithWhatItCan) {
  EXPECT_THAT(refusal("fps=2000"), HasSubstr("AcquisitionFrameRate=2000 - expected 0.1 to 1000"));
  EXPECT_THAT(refusal("pixel_format=Mono12"), HasSubstr("PixelFormat=Mono12 - expected one of"));
  EXPECT_THAT(refusal("strobe=Line2"), HasSubstr("cannot set the strobe line"));
  EXPECT_THAT(refusal("NoSuchThing=3"), HasSubstr("no feature 'NoSuchThing'"));
  EXPECT_THAT(refusal("exposure_us=fast"), HasSubstr("exposure_us=fast - expected a number"));
}

TEST_F(AravisFakeCamera, ASecondProgramIsToldThatItIsHeld) {
  const auto source = open_source("gige:127.0.0.1");
  EXPECT_THAT(refusal("fps=10"), HasSubstr("busy: held by another program"));
}

TEST_F(AravisFakeCamera, AnUnknownNameIsAnsweredWithThoseThatAreThere) {
  const Error error = testing::error_of([] { open_source("gige:NOBODY"); });
  EXPECT_EQ(error.kind(), ErrorKind::kNotFound);
  EXPECT_THAT(error.what(), HasSubstr(kSerial));
}

}  // namespace
}  // namespace striper
