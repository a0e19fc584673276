// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <striper/core/controls.hpp>
#include <striper/pipeline/scan_explanation.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/stream/frame_reader.hpp>
#include <striper/stream/scan_bus.hpp>

namespace striper {

/// A scanner, and what it works with.
struct HeadScanner {
  Scanner scanner;
  std::shared_ptr<const StriperModel> model;  ///< Null without one.
  StripeAxis axis = StripeAxis::kColumns;
  bool adapts_exposure = false;  ///< The head sets the source's exposure by the stripe.
};

/// What a head is made of.
struct HeadParts {
  /// Opens the source; again where it was lost. @throws Error.
  std::function<std::unique_ptr<FrameSource>(const EventPort&)> open;
  /// Makes the scanner for a source. @throws Error.
  std::function<HeadScanner(const SourceInfo&, const EventPort&)> make_scanner;
  /// Makes it with what the model's file holds by now, for `Head::reload`; may be empty.
  std::function<HeadScanner(const SourceInfo&, const EventPort&)> remake_scanner;

  // Whoever looks over the head's shoulder, on its thread; may be empty.
  std::function<void(const Frame&)> before_scan;
  std::function<void(ScanSpan)> after_scan;
};

struct HeadOptions {
  std::string name{kDefaultHead};
  FrameLimits limits;
  /// Waits for a source that is not there yet, and opens a lost one again, for ever.
  bool reopens = false;
  std::chrono::milliseconds retry_every{1000};
  EventPort events;
  std::function<bool()> should_stop;  ///< Asked ten times a second; may be empty.
};

/// How a head is.
struct HeadHealth {
  SourceState state = SourceState::kWaiting;
  std::uint64_t times_opened = 0;  ///< The source.
  FrameReport read;  ///< Of the source that is open, `elapsed_s` and `statistics` as of `time`.
  ScannerStatus scanner;
  double rate_hz = 0.0;                        ///< Frames a second, of late.
  std::chrono::steady_clock::time_point time;  ///< When the head last knew how it is.
};

/// A source and its scanner: reads frames, scans them and gives the scans, frames and status to a
/// bus. The bus hears of the head with its first frame, so that no file gives way to nothing.
///
/// Threads: `run` works on the caller's thread, `start` on one of the head's own; everything else
/// may be called from any thread, what is noexcept from a signal handler too. What asks the source
/// takes as long as its camera takes to answer.
class Head {
 public:
  /// @param bus outlives the head.
  Head(HeadParts parts, HeadOptions options, ScanBus& bus);
  Head(const Head&) = delete;
  Head& operator=(const Head&) = delete;
  ~Head();  ///< Stops.

  /// Until the source ends, a limit is reached or it is told to stop. What the scanner holds back
  /// is given at the end. @throws Error what opening, `start` and the parts throw; with `reopens` a
  /// source that is not there, or refuses, is waited for. A camera that was lost is closed on a
  /// thread of its own, since it would be waited for for seconds (`FrameReport::is_lost`).
  FrameReport run();

  void start();
  bool is_running() const noexcept;
  /// Waits for the end of what `start` began. @throws as `run`.
  FrameReport wait();

  void request_stop() noexcept;

  /// Makes the scanner anew before the next frame: model_reloaded, or model_refused and the old one
  /// goes on.
  void reload() noexcept;
  /// The same for other options: it is silent where that works.
  void remake_scanner() noexcept;

  /// Closes the source, and with it the lasers that it fires, until `resume`, which opens it again:
  /// a file from its start.
  void pause() noexcept;
  void resume() noexcept;

  /// The controls of the source that is open. @throws Error{kDevice} where none is; as `Controls`.
  std::vector<Control> controls() const;
  /// Sets one and reads it back. A source that is opened later gets the same value: control_refused
  /// where it does not take it. @throws as `controls`, and as `Controls::set`.
  Control set_control(std::string_view name, const ControlValue& value);
  /// Sets the control `laser`; also for a source that is opened later, where none is open.
  /// @throws Error{kUsage} where the source has no such control.
  void switch_lasers(bool are_on);

  /// Why a scan line of the frame that gives the next scan gives what it gives: waits for that one.
  /// @throws Error{kDevice} where none comes in that time; as `Scanner::explain`, whose option
  ///         `can_explain` the scanner needs.
  ScanExplanation explain(int line,
                          std::chrono::milliseconds timeout = std::chrono::seconds(2)) const;

  HeadHealth health() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
