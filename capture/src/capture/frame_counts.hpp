// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include <striper/core/frame.hpp>
#include <striper/core/frame_source.hpp>

namespace striper::detail {

/// The SourceStatistics of a source, counted by its threads and read by any.
class FrameCounts {
 public:
  void reset();

  /// A frame that `next` gives, by its status.
  void deliver(const Frame& frame);
  /// The same of a source that gives what is in a file: what its numbers leave out was dropped.
  void deliver_recorded(const Frame& frame);

  void drop(std::uint64_t frames);
  void overrun(std::uint64_t frames);
  void reconnect();

  SourceStatistics now() const;

 private:
  void count(const Frame& frame) noexcept;

  mutable std::mutex mutex_;  // Guards all.
  SourceStatistics counts_;
  std::optional<std::uint64_t> last_sequence_;
};

}  // namespace striper::detail
