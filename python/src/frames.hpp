// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>

#include "waiting.hpp"

namespace striper::python {

/// A source of frames that starts with its first frame.
class Source {
 public:
  explicit Source(std::unique_ptr<FrameSource> source)
      : source_(std::move(source)), info_(source_->info()) {}

  const SourceInfo& info() const noexcept { return info_; }
  FrameSource& frames() { return **source_; }

  void start();
  void stop();
  /// @param frame what it gives. @param timeout_s empty: for ever.
  NextStatus next(Frame& frame, std::optional<double> timeout_s);

 private:
  Unlocked<std::unique_ptr<FrameSource>> source_;
  SourceInfo info_;
  bool is_started_ = false;
};

}  // namespace striper::python
