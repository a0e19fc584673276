// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string_view>

#include <striper/stream/scan_sink.hpp>

namespace striper {

/// Gives scans, one after the other, from a recording or from frames that are scanned on the way.
/// One thread at a time.
class ScanSource {
 public:
  ScanSource() = default;
  ScanSource(const ScanSource&) = delete;
  ScanSource& operator=(const ScanSource&) = delete;
  virtual ~ScanSource() = default;

  /// Whose scans they are. Of several heads in a file: the first's; each scan says its own.
  virtual HeadInfo info() const = 0;

  /// The same of another head, one that a scan names.
  virtual HeadInfo info_of(std::string_view head) {
    HeadInfo info = this->info();
    info.head = head;
    return info;
  }

  /// Waits at most `timeout` for the next scan and puts it into `scan`, whose memory is reused.
  /// Files time out only where no scan comes of their frames. @throws Error{kBadFile} naming file,
  /// line and what was expected.
  virtual NextStatus next(PolarScan& scan, std::chrono::milliseconds timeout) = 0;

  /// Makes a waiting `next` return kStopped, and every later one of a camera; from any thread.
  /// Files do not wait.
  virtual void stop() {}
};

}  // namespace striper
