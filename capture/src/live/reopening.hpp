// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include <striper/core/event.hpp>

#include "live/stream_kind.hpp"

namespace striper::detail {

/// What a live source does about a device that is lost: when to open it again, whether it is the
/// same stream then, when to give up, and what to say of all that. Not thread-safe.
class Reopening {
 public:
  /// Pauses between attempts begin with `first` and double to `longest`.
  struct Pauses {
    std::chrono::milliseconds first{0};
    std::chrono::milliseconds longest{0};
  };
  enum class Outcome {
    kBack,    ///< It streams again.
    kNotYet,  ///< To be tried again after `pause`.
    kGone,    ///< It was lost for too long.
  };

  /// @param device its name, for messages. @param kind what it streams, as it was opened first.
  /// @param give_up_s after so long without it; 0: it is not opened again at all.
  Reopening(EventPort events, std::string device, StreamKind kind, const Pauses& pauses,
            double give_up_s);

  /// Sends `source_lost`, or `source_gone` where the device is not to be opened again.
  /// @return whether it is.
  bool lose(const std::string& why);

  /// Before the next attempt; none before the first.
  std::chrono::milliseconds pause() const noexcept { return pause_; }

  /// Sends `source_back`; `source_not_open` with the reason, once for each; or `source_gone`.
  /// @param open opens the device and lets it stream; throws where it cannot.
  Outcome attempt(const std::function<void()>& open);

  /// @throws Error{kDevice} where a device that was opened again streams something else.
  void require_same(const StreamKind& now) const;

 private:
  using Clock = std::chrono::steady_clock;

  EventPort events_;
  std::string device_;
  StreamKind kind_;
  Pauses pauses_;
  double give_up_s_;

  Clock::time_point lost_at_;
  std::chrono::milliseconds pause_{0};
  std::string last_refusal_;
};

}  // namespace striper::detail
