// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/scan/scan_span.hpp>
#include <striper/stream/scan_sink.hpp>

namespace striper {

/// How patient a ScanBus is.
struct BusOptions {
  std::chrono::milliseconds stuck_after{5000};  ///< A sink that does not return is closed.
  std::chrono::milliseconds live_hold{2000};    ///< What a lossless sink's queue holds, if live.
  /// How many scans wait for a lossless sink before their source does: enough to keep writing and
  /// scanning from taking turns, and a few megabytes.
  std::size_t scans_waiting = 32;
  std::chrono::milliseconds status_every{1000};
};

/// How a sink is.
struct SinkReport {
  enum class State {
    kOpen,
    kFinished,  ///< All that was given to it, losses aside, is written.
    kClosed,    ///< It threw, or did not return.
  };

  std::string uri;
  State state = State::kOpen;
  Delivery delivery = Delivery::kLossless;
  std::uint64_t written = 0;  ///< Scans whose `write` returned.
  std::uint64_t lost = 0;     ///< Scans that it never got or did not finish; written + lost is all
                              ///< that were given, once finished.
};

/// `open`, `finished` or `closed`.
std::string_view to_string(SinkReport::State state) noexcept;

/// Gives every scan to every sink, each on a thread of its own with a bounded queue, so that none
/// holds up another: see Delivery. One that throws or does not return is closed with the event
/// sink_failed or disk_full; losses are said with sink_slow, when they begin and in all.
///
/// Threads: everything may be called from any thread. Only `write` of a scan from a source that can
/// wait ever waits, and never longer than `stuck_after` for one that is stuck.
/// Nothing is allocated per scan in steady state.
class ScanBus {
 public:
  /// @param events hears of the sinks. It may hand them back to `event`, for the other sinks.
  explicit ScanBus(EventPort events = {}, const BusOptions& options = {});
  ScanBus(const ScanBus&) = delete;
  ScanBus& operator=(const ScanBus&) = delete;
  ~ScanBus();  ///< Finishes.

  /// Adds a sink, which hears of the heads that are open at once.
  /// @param uri what it is called in events and reports.
  void add(std::string uri, std::unique_ptr<ScanSink> sink);
  /// Takes sinks of that name away again: writes what is queued for them, finishes them and waits
  /// for that. @return how they were; `failure` tells no more of them.
  std::vector<SinkReport> remove(std::string_view uri);

  void open(const HeadInfo& head);
  void write(const std::shared_ptr<const PolarScan>& scan);
  void write(ScanSpan scans);
  /// Copies the pixels where a sink wants the frame, which then says whose it is.
  void write(const Frame& frame, std::string_view head = kDefaultHead);
  /// Passed on once a second and when it changed: call it as often as you like.
  void status(const ScannerStatus& status);
  void event(const Event& event);
  /// What was found in a scan, after the scan.
  void curbs(CurbsSeen seen);
  void objects(ObjectsSeen seen);

  /// Writes what is queued, finishes every sink and waits for that. A second call does nothing.
  void finish();

  std::vector<SinkReport> sinks() const;
  bool is_any_open() const;

  /// What a sink threw (an Error{kIo} for one that was stuck); null while none has failed.
  std::exception_ptr failure() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
