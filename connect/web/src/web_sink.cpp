// SPDX-License-Identifier: Apache-2.0
#include "web_sink.hpp"

#include <charconv>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <striper/stream/scan_topics.hpp>

#include "head_watch.hpp"
#include "page.hpp"
#include "web_server.hpp"

namespace striper::detail {
namespace {

ScanTopics::Options topics_of(const WebAddress& address) {
  ScanTopics::Options options;
  options.has_images = address.frames_hz > 0.0;
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
        server_(address, [this](const Target& target) { return answer(target); }),
        topics_(server_),
        scans_(topics_, topics_of(address)) {}

  SinkNeeds needs() const override {
    SinkNeeds needs;
    needs.status = true;
    needs.frames_hz = frames_hz_;
    needs.delivery = Delivery::kNewest;
    return needs;
  }

  void set_services(const SinkServices& services) override { watch_.set_services(services); }

  void set_events(const EventPort& events) override {
    events.send(Event("topics_offered", server_.url() + " shows the scans, to Foxglove and "
                                                        "Lichtblick too"));
  }

  void open(const HeadInfo& head) override { scans_.open(head); }
  void write(const PolarScan& scan) override {
    watch_.see(scan);
    scans_.write(scan);
  }
  void write(const Frame& frame) override { scans_.write(frame); }
  void status(const ScannerStatus& status) override { scans_.status(status); }
  void event(const Event& event) override { watch_.see(event); }
  void finish() override { server_.stop(); }

 private:
  HttpAnswer answer(const Target& target);

  const double frames_hz_;
  HeadWatch watch_;
  WebServer server_;
  WebTopics topics_;
  ScanTopics scans_;
};

std::uint64_t number(std::string_view text) {
  std::uint64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

HttpAnswer WebSink::answer(const Target& target) {
  HttpAnswer answer;
  if (target.path == "/healthz") {
    answer.type = "text/plain; charset=utf-8";
    answer.body = "alive\n";
  } else if (target.path == "/readyz") {
    answer = watch_.readiness();
  } else if (target.path == "/metrics") {
    answer.type = "text/plain; version=0.0.4; charset=utf-8";
    answer.body = watch_.metrics(server_.counts());
  } else if (target.path == "/api/v1/status") {
    answer.body = watch_.status_json();
  } else if (target.path == "/api/v1/events") {
    answer.body = watch_.events_json(number(target.value("since")));
  } else if (const PageFile* const file = find_page_file(target.path)) {
    answer.type = file->type;
    answer.body = file->content;
  } else {
    answer.status = 404;
    answer.type = "text/plain; charset=utf-8";
    answer.body = "there is nothing here\n";
  }
  return answer;
}

}  // namespace

std::unique_ptr<ScanSink> make_web_sink(const WebAddress& address) {
  return std::make_unique<WebSink>(address);
}

}  // namespace striper::detail
