// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>

#include <striper/stream/scan_sink.hpp>

namespace striper::program {

/// One sink for two buses: that of the head that measures, whose the sink is, and that of a
/// recording that is played back, which is its guest. Guests neither set it up nor finish it, and
/// give it nothing once it is finished. Thread-safe, the parts among each other.
class SharedSink {
 public:
  explicit SharedSink(std::unique_ptr<ScanSink> sink);

  /// For the bus whose the sink is; once.
  std::unique_ptr<ScanSink> owner() const;
  /// For another bus; as often as you like.
  std::unique_ptr<ScanSink> guest() const;

 private:
  struct Shared {
    std::mutex mutex;
    std::unique_ptr<ScanSink> sink;
    bool is_finished = false;
  };
  class Part;

  std::shared_ptr<Shared> shared_;
};

}  // namespace striper::program
