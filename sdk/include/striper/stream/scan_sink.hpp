// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/frame_source.hpp>
#include <striper/model/striper_model.hpp>
#include <striper/pipeline/scanner_status.hpp>
#include <striper/scan/polar_scan.hpp>
#include <striper/stream/scan_findings.hpp>

namespace striper {

/// Where scans come from, said before the first of them.
struct HeadInfo {
  std::string head{kDefaultHead};
  SourceInfo source;
  std::shared_ptr<const StriperModel> model;  ///< Null where the scans have no ranges.
  StripeAxis axis = StripeAxis::kColumns;
  std::vector<std::shared_ptr<const ScanFrame>> frames;  ///< One per laser; at least one.

  /// Whether the scans wait for whoever is slow.
  bool can_wait() const noexcept { return !source.is_live; }
};

/// Fills in a HeadInfo, frames and all. @throws as `make_scan_frame` does.
HeadInfo head_info(std::string_view head, const SourceInfo& source,
                   const std::shared_ptr<const StriperModel>& model, StripeAxis axis);

/// What is given up where a sink does not keep up.
enum class Delivery {
  kLossless,  ///< Nothing from a source that can wait; of a live one whole scans, after 2 s.
  kNewest,    ///< All but the two newest scans: for whoever shows or steers.
};

/// What a sink wants to hear of. Events come in any case.
struct SinkNeeds {
  bool scans = true;
  bool status = false;
  double frames_hz = 0.0;  ///< At most so many frames a second of each head; 0: none.
  Delivery delivery = Delivery::kLossless;
};

struct SinkServices;

/// Somebody who wants scans: a file, another program, a page.
///
/// Life: made by `open_sink`, given to a ScanBus, `open` for every head (again where its model
/// changed), then `write`, `status` and `event` in any order, `finish`, destroyed. All but `needs`
/// and `set_events` is called from one thread of the sink's own: no locks are needed, and a slow
/// sink holds up nobody. What throws or does not return for 5 s is closed: it is called no more.
/// Its destructor then leaves what was written whole.
///
/// A class that overrides one `write` says `using ScanSink::write;` for the other.
class ScanSink {
 public:
  ScanSink() = default;
  ScanSink(const ScanSink&) = delete;
  ScanSink& operator=(const ScanSink&) = delete;
  virtual ~ScanSink() = default;

  virtual SinkNeeds needs() const { return {}; }

  /// Who hears of what the sink finds by itself; called once, before all but `needs`.
  virtual void set_events(const EventPort& /*events*/) {}
  /// What the sink may ask of the program; called at most once, before `open`.
  virtual void set_services(const SinkServices& /*services*/) {}
  virtual void open(const HeadInfo& /*head*/) {}
  virtual void write(const PolarScan& /*scan*/) {}
  virtual void write(const Frame& /*frame*/) {}  // `Frame::head` says whose it is.
  /// Once a second, and when something other than a count changed.
  virtual void status(const ScannerStatus& /*status*/) {}
  virtual void event(const Event& /*event*/) {}
  /// What was found in a scan that was written before.
  virtual void curbs(const CurbsSeen& /*seen*/) {}
  virtual void objects(const ObjectsSeen& /*seen*/) {}
  /// There will be nothing more. @throws Error{kIo} where what was written is not safe.
  virtual void finish() {}
};

}  // namespace striper
