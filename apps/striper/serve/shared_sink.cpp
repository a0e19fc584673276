// SPDX-License-Identifier: Apache-2.0
#include "serve/shared_sink.hpp"

#include <utility>

#include <striper/stream/sink_services.hpp>

namespace striper::program {

class SharedSink::Part : public ScanSink {
 public:
  Part(std::shared_ptr<Shared> shared, bool is_owner)
      : shared_(std::move(shared)), is_owner_(is_owner) {}

  SinkNeeds needs() const override { return shared_->sink->needs(); }
  void set_events(const EventPort& events) override {
    if (is_owner_) shared_->sink->set_events(events);
  }
  void set_services(const SinkServices& services) override {
    if (is_owner_) shared_->sink->set_services(services);
  }
  void open(const HeadInfo& head) override {
    give([&](ScanSink& sink) { sink.open(head); });
  }
  void write(const PolarScan& scan) override {
    give([&](ScanSink& sink) { sink.write(scan); });
  }
  void write(const Frame& frame) override {
    give([&](ScanSink& sink) { sink.write(frame); });
  }
  void status(const ScannerStatus& status) override {
    give([&](ScanSink& sink) { sink.status(status); });
  }
  void event(const Event& event) override {
    if (is_owner_) give([&](ScanSink& sink) { sink.event(event); });
  }
  void finish() override {
    if (!is_owner_) return;
    {
      const std::lock_guard lock(shared_->mutex);
      shared_->is_finished = true;
    }
    shared_->sink
        ->finish();  // Not under the lock: it waits for those who ask, who may wait for it.
  }

 private:
  template <typename What>
  void give(What what) {
    const std::lock_guard lock(shared_->mutex);
    if (!shared_->is_finished) what(*shared_->sink);
  }

  const std::shared_ptr<Shared> shared_;
  const bool is_owner_;
};

SharedSink::SharedSink(std::unique_ptr<ScanSink> sink) : shared_(std::make_shared<Shared>()) {
  shared_->sink = std::move(sink);
}

std::unique_ptr<ScanSink> SharedSink::owner() const {
  return std::make_unique<Part>(shared_, true);
}

std::unique_ptr<ScanSink> SharedSink::guest() const {
  return std::make_unique<Part>(shared_, false);
}

}  // namespace striper::program
