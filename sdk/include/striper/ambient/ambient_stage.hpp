// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <striper/ambient/ambient_options.hpp>
#include <striper/ambient/channel_choice.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/lit_frame.hpp>

namespace striper {

/// Turns frames into lit frames: takes interlaced pictures apart, knows which exposure is lit and
/// by which laser, picks the channel. One stage serves one stream, in order; not thread-safe.
class AmbientStage {
 public:
  /// @throws Error{kUnsupported} for a method that this build lacks.
  explicit AmbientStage(const AmbientOptions& options);

  /// Returns the lit exposures that this frame completes: none for a dark one, two for two lit
  /// fields. They are valid until the next call and only as long as `frame` is. Precondition:
  /// frame.status is kOk and the image is not empty.
  std::span<const LitFrame> push(const Frame& frame);

  std::uint64_t dark_exposures() const noexcept { return dark_; }

  /// What was decided, for people: the channel, the cadence. One line each; empty before the first
  /// frame.
  std::string decisions() const;

 private:
  void push_exposure(const Frame& exposure);

  AmbientOptions options_;
  bool channel_is_chosen_ = false;
  std::vector<ChannelImages> channels_;  // One per exposure of a picture.
  std::vector<LitFrame> lit_;
  std::uint64_t dark_ = 0;
};

}  // namespace striper
