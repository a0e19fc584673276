// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <iterator>
#include <string>
#include <string_view>

#include <striper/stream/scan_sink.hpp>

namespace striper {

/// Gives scans, one after the other, from a recording or from frames that are scanned on the way.
/// One thread at a time.
///
///     for (const PolarScan& scan : *open_scans("v4l2:", model)) ...
///
/// goes on until the source ends or `stop` is called, waiting for a silent camera; who wants to
/// hear of silence asks by `next`.
class ScanSource {
 public:
  /// The scan that came last: valid until the next step, which reuses its memory. Steps throw what
  /// `next` does.
  class Iterator {
   public:
    using value_type = PolarScan;
    using difference_type = std::ptrdiff_t;

    explicit Iterator(ScanSource& source) : source_(&source) { ++*this; }
    Iterator(Iterator&&) = default;
    Iterator& operator=(Iterator&&) = default;
    Iterator(const Iterator&) = delete;  // Two would take each other's scans.
    Iterator& operator=(const Iterator&) = delete;
    ~Iterator() = default;

    const PolarScan& operator*() const noexcept { return scan_; }
    const PolarScan* operator->() const noexcept { return &scan_; }
    Iterator& operator++() {
      status_ = NextStatus::kTimeout;
      while (status_ == NextStatus::kTimeout) status_ = source_->next(scan_, kPatience);
      return *this;
    }
    void operator++(int) { ++*this; }
    friend bool operator==(const Iterator& it, std::default_sentinel_t) noexcept {
      return it.status_ != NextStatus::kFrame;
    }

   private:
    static constexpr std::chrono::milliseconds kPatience{1000};

    ScanSource* source_;
    PolarScan scan_;
    NextStatus status_ = NextStatus::kTimeout;
  };

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

  /// What could not be read of a file that was cut off (its writer was killed, it was copied in
  /// part), a sentence that names the file; empty where nothing is missing. Known once `next`
  /// returned kEnd.
  virtual std::string loss() const { return {}; }

  /// Makes a waiting `next` return kStopped, and every later one of a camera; from any thread.
  /// Files do not wait.
  virtual void stop() {}

  /// Waits for the next scan; a second loop goes on where the first was left.
  Iterator begin() { return Iterator(*this); }
  static std::default_sentinel_t end() noexcept { return std::default_sentinel; }
};

}  // namespace striper
