// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>

#include <gtest/gtest.h>

#include <striper/core/frame_source.hpp>

namespace striper::testing {

/// What became of the frames of a lossy stream.
struct TakenFrames {
  std::uint64_t whole = 0;
  std::uint64_t last = 0;  ///< Number of the last one taken.

  /// Every frame up to the last one is delivered or counted as lost, and not whole only where
  /// that is counted too.
  void expect_accounted_for(const SourceStatistics& got) const {
    EXPECT_EQ(last + 1, got.delivered + got.dropped + got.overrun);
    EXPECT_EQ(whole + got.incomplete, got.delivered);
  }
};

/// Takes `count` frames, of which each that is whole must be as it was sent.
inline TakenFrames take_frames(FrameSource& source, int count,
                               const std::function<bool(const Frame&)>& is_as_sent) {
  TakenFrames taken;
  Frame frame;
  for (int n = 0; n < count; ++n) {
    if (source.next(frame, std::chrono::seconds(2)) != NextStatus::kFrame) {
      ADD_FAILURE() << "no frame after " << n;
      break;
    }
    taken.last = frame.sequence;
    if (frame.status != FrameStatus::kOk) continue;
    ++taken.whole;
    EXPECT_TRUE(is_as_sent(frame)) << "frame " << frame.sequence;
  }
  return taken;
}

}  // namespace striper::testing
