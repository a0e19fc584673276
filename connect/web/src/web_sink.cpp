// SPDX-License-Identifier: Apache-2.0
#include "web_sink.hpp"

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <striper/stream/scan_topics.hpp>

#include "head_watch.hpp"
#include "scan_pieces.hpp"
#include "web_api.hpp"
#include "web_server.hpp"

namespace striper::detail {
namespace {

ScanTopics::Options topics_of(const WebAddress& address) {
  ScanTopics::Options options;
  options.images = address.images;
  options.has_own_messages = true;
  return options;
}

// The channels of a server.
class WebTopics : public TopicPort {
 public:
  explicit WebTopics(WebServer& server) : server_(server) {}

  int offer(const std::string& topic, const wire::MessageSchema& schema,
            wire::RosQos qos) override {
    const bool is_latched = qos == wire::RosQos::kLatched;
    return static_cast<int>(server_.add_channel(topic, schema.name, schema.text, is_latched));
  }

  bool is_wanted(int topic) const override {
    return server_.is_wanted(static_cast<std::uint32_t>(topic));
  }

  void send(int topic, std::span<const std::uint8_t> cdr, std::int64_t time_ns) override {
    auto payload = std::make_shared<Payload>();
    payload->bytes.assign(cdr.begin(), cdr.end());
    payload->time_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(0, time_ns));
    server_.publish(static_cast<std::uint32_t>(topic), std::move(payload));
  }

 private:
  WebServer& server_;
};

class WebSink : public ScanSink {
 public:
  explicit WebSink(const WebAddress& address)
      : frames_hz_(address.frames_hz),
        api_(watch_, pieces_, [this] { return server_.counts(); }),
        server_(address, api_),
        topics_(server_),
        scans_(topics_, topics_of(address)) {}

  SinkNeeds needs() const override {
    SinkNeeds needs;
    needs.status = true;
    needs.frames_hz = frames_hz_;
    needs.delivery = Delivery::kNewest;
    return needs;
  }

  void set_services(const SinkServices& services) override {
    watch_.set_services(services);
    api_.set_services(services);
  }

  void set_events(const EventPort& events) override {
    api_.set_events(events);
    events.send(Event("topics_offered", server_.url() + " shows the scans, to Foxglove and "
                                                        "Lichtblick too"));
  }

  void open(const HeadInfo& head) override {
    api_.see(head);
    watch_.see(head);
    scans_.open(head);
  }
  void write(const PolarScan& scan) override {
    watch_.see(scan);
    pieces_.see(scan);
    scans_.write(scan);
  }
  void write(const Frame& frame) override { scans_.write(frame); }
  void status(const ScannerStatus& status) override { scans_.status(status); }
  void event(const Event& event) override { watch_.see(event); }
  void curbs(const CurbsSeen& seen) override { scans_.curbs(seen); }
  void objects(const ObjectsSeen& seen) override { scans_.objects(seen); }
  void finish() override { server_.stop(); }

 private:
  const double frames_hz_;
  HeadWatch watch_;
  ScanPieces pieces_;
  WebApi api_;
  WebServer server_;
  WebTopics topics_;
  ScanTopics scans_;
};

}  // namespace

std::unique_ptr<ScanSink> make_web_sink(const WebAddress& address) {
  return std::make_unique<WebSink>(address);
}

}  // namespace striper::detail
