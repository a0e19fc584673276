// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/ambient/channel_choice.hpp>
#include <striper/core/frame.hpp>

namespace striper::detail {

/// One exposure that may still be needed, as lit or as dark.
struct HeldExposure {
  Frame frame;
  std::uint64_t number = 0;  ///< Its place in time, gaps included.
  Illumination light;        ///< Unknown until the pattern is.
  bool is_done = false;      ///< A lit one that has been handed out.
  cv::Mat own;               ///< Pixels of a frame that nobody else keeps.
  bool has_channel = false;
  ChannelImages channel;
};

/// The dark exposures around a lit one.
struct Neighbours {
  HeldExposure* before = nullptr;
  HeldExposure* after = nullptr;
  double weight_after = 0.5;
  bool is_between_rows = false;  ///< They are fields of the other parity.
  bool must_wait = false;        ///< The dark exposure after is still to come.
};

/// Which dark exposures may serve.
enum class DarkChoice {
  kNone,      ///< Nothing is subtracted, nothing is waited for.
  kSameRows,  ///< Frames, or fields of the same parity.
  kAny,       ///< Fields of the other parity too, where no nearer one has the same rows.
};

/// Oldest first.
using HeldExposures = std::vector<std::unique_ptr<HeldExposure>>;

}  // namespace striper::detail
