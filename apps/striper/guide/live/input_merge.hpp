// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <variant>
#include <vector>

#include <striper/guidance/guidance.hpp>

namespace striper::program {

/// A live input; of one time they come in this turn, as in a recorded run.
using LiveInput = std::variant<OdometerReading, TruckState, BeamSweep>;

/// Puts what several threads give into the order of time.
///
/// Each stream (a head, an odometer of its own) gives in its own order of time. What is given waits
/// until every stream has come as far, or has been silent for longer than streams are waited for.
/// What comes later than that is left out and counted. Thread-safe.
class InputMerge {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param patience how long a stream is waited for: a few of its periods.
  InputMerge(std::size_t streams, std::chrono::milliseconds patience);

  void give(std::size_t stream, LiveInput input);
  /// A stream that begins anew, or has ended: nothing of it is waited for until it gives again.
  void leave(std::size_t stream);
  void close();  ///< There will be nothing more: what waits is given out.

  /// The next one, in the order of time. @return nothing where none came in time.
  std::optional<LiveInput> next(std::chrono::milliseconds timeout);
  bool is_over() const;  ///< Closed, and all is given out.
  /// When anything was given last, whether or not it has been given out yet; nothing before.
  std::optional<Clock::time_point> heard() const;
  /// The same, of an odometer's readings.
  std::optional<Clock::time_point> heard_odometer() const;
  std::uint64_t late() const;

 private:
  struct Stream {
    double last_s = 0.0;
    Clock::time_point heard;
    bool is_waited_for = false;
  };
  bool is_due(const LiveInput& input, Clock::time_point now) const;
  void insert(LiveInput input);
  void begin_anew();

  mutable std::mutex mutex_;
  std::condition_variable came_;
  std::vector<Stream> streams_;
  std::chrono::milliseconds patience_;
  std::optional<Clock::time_point> heard_;
  std::optional<Clock::time_point> heard_odometer_;
  std::deque<LiveInput> waiting_;  // In the order of time.
  double given_s_;                 // Of the last one that was given out.
  std::uint64_t late_ = 0;
  bool is_closed_ = false;
};

/// Seconds, on the scans' clock.
double time_of(const LiveInput& input);

}  // namespace striper::program
