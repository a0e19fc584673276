// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include <striper/stream/scan_sink.hpp>

namespace striper::testing {

/// A sink that does what a test says with each scan.
class SinkThat : public ScanSink {
 public:
  using Action = std::function<void(const PolarScan&)>;

  explicit SinkThat(Action action, const SinkNeeds& needs = {})
      : action_(std::move(action)), needs_(needs) {}
  using ScanSink::write;
  SinkNeeds needs() const override { return needs_; }
  void write(const PolarScan& scan) override { action_(scan); }

 private:
  Action action_;
  SinkNeeds needs_;
};

/// A door that stays shut until a test opens it. Copies are of the same door.
class Door {
 public:
  void open() const {
    const std::lock_guard lock(shared_->mutex);
    shared_->is_open = true;
    shared_->opened.notify_all();
  }
  void wait() const {
    std::unique_lock lock(shared_->mutex);
    shared_->opened.wait(lock, [&] { return shared_->is_open; });
  }

 private:
  struct Shared {
    std::mutex mutex;
    std::condition_variable opened;
    bool is_open = false;
  };
  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
};

}  // namespace striper::testing
