// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

#include "capture/v4l2/fake_camera.hpp"
#include "support/error_of.hpp"
#include "v4l2/v4l2_stream.hpp"

namespace striper::testing {

constexpr std::chrono::milliseconds kPatience{2000};

/// A fake camera and sources that open it.
struct Rig {
  explicit Rig(const FakeCamera::Setup& setup = FakeCamera::Setup{})
      : camera(std::make_shared<FakeCamera>(setup)) {
    options.device = "/dev/video7";
  }
  std::unique_ptr<FrameSource> open() const { return detail::v4l2::open(options, camera); }
  std::unique_ptr<FrameSource> open_and_start() const {
    auto source = open();
    source->start();
    return source;
  }

  std::shared_ptr<FakeCamera> camera;
  V4l2Options options;
};

inline FakeCamera::Setup television(std::uint32_t field, v4l2_std_id standard = V4L2_STD_NTSC_M) {
  FakeCamera::Setup setup;
  setup.field = field;
  setup.standard = standard;
  return setup;
}

/// The next frame, which must come.
inline Frame next(FrameSource& source) {
  Frame frame;
  EXPECT_EQ(source.next(frame, kPatience), NextStatus::kFrame);
  return frame;
}

inline std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// Waits until a condition holds: things on the capture thread take a moment.
template <typename Condition>
bool eventually(const Condition& condition) {
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace striper::testing
