// SPDX-License-Identifier: Apache-2.0
#include "head_watch.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace striper::detail {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr auto kReadyWithin = 1500ms;
constexpr std::size_t kMostEvents = 1000;

double seconds(HeadWatch::Clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

// By the source itself, and by opening it again.
std::uint64_t reconnects(const HeadHealth& health) {
  return health.read.statistics.reconnects +
         (health.times_opened > 0 ? health.times_opened - 1 : 0);
}

// Texts of others may be no UTF-8.
std::string dump(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
}

// Prometheus: backslash, quote and line feed.
std::string label(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\' || c == '"') out += '\\';
    if (c == '\n') {
      out += "\\n";
    } else {
      out += c;
    }
  }
  return out;
}

class Metrics {
 public:
  void begin(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    fmt::format_to(std::back_inserter(text_), "# HELP {0} {2}\n# TYPE {0} {1}\n", name, type, help);
  }
  void add(std::string_view key, std::string_view value, double number) {
    add_part("", key, value, number);
  }
  void add_part(std::string_view part, std::string_view key, std::string_view value,
                double number) {
    fmt::format_to(std::back_inserter(text_), "{}{}{{{}=\"{}\"}} {}\n", name_, part, key,
                   label(value), std::isnan(number) ? "NaN" : fmt::format("{}", number));
  }
  void add_bucket(std::string_view head, std::string_view bound, std::uint64_t count) {
    fmt::format_to(std::back_inserter(text_), "{}_bucket{{head=\"{}\",le=\"{}\"}} {}\n", name_,
                   label(head), bound, count);
  }
  void add(double number) { text_ += fmt::format("{} {}\n", name_, number); }

  std::string text() && { return std::move(text_); }

 private:
  std::string name_;
  std::string text_;
};

json event_json(std::uint64_t number, const Event& event) {
  return {
      {"n", number},           {"code", event.code.word()}, {"severity", to_string(event.severity)},
      {"head", event.head},    {"time_s", event.time_s},    {"message", event.message},
      {"advice", event.advice}};
}

}  // namespace

void HeadWatch::set_services(const SinkServices& services) {
  const std::lock_guard lock(mutex_);
  services_ = services;
}

HeadWatch::Head& HeadWatch::head_of(std::string_view name) {
  const auto found = heads_.find(name);
  if (found != heads_.end()) return found->second;
  Head& added = heads_.emplace(std::string(name), Head{}).first->second;
  added.last = Clock::now();
  return added;
}

void HeadWatch::see(const HeadInfo& head) {
  const std::lock_guard lock(mutex_);
  head_of(head.head).lasers = head.frames.size();
}

void HeadWatch::see(const PolarScan& scan) {
  const std::lock_guard lock(mutex_);
  Head& head = head_of(scan.head());
  sigmas_m_.clear();
  std::size_t good = 0;
  for (const Return& one : scan.returns) {
    if (one.status != ReturnStatus::kOk) continue;
    ++good;
    if (one.sigma_m > 0.0) sigmas_m_.push_back(one.sigma_m);
  }
  ++head.scans;
  head.returns += scan.returns.size();
  head.good_returns += good;
  head.good_part = scan.returns.empty()
                       ? 0.0
                       : static_cast<double>(good) / static_cast<double>(scan.returns.size());
  head.median_sigma_m = std::numeric_limits<double>::quiet_NaN();
  if (!sigmas_m_.empty()) {
    const auto middle = sigmas_m_.begin() + std::ssize(sigmas_m_) / 2;
    std::nth_element(sigmas_m_.begin(), middle, sigmas_m_.end());
    head.median_sigma_m = *middle;
  }
  head.laser = scan.laser;
  note_latency(head, scan.time);
  head.last = Clock::now();
}

// Of sources that have this machine's clock.
void HeadWatch::note_latency(Head& head, const FrameTime& time) {
  constexpr std::size_t kKept = 256;
  if (!time.utc_offset_ns) return;
  const auto now = Clock::now().time_since_epoch();  // CLOCK_MONOTONIC, as the frame's time.
  const double latency_s = seconds(now - std::chrono::nanoseconds(time.monotonic_ns));
  if (latency_s < 0.0) return;
  ++head.latency_count;
  head.latency_sum_s += latency_s;
  for (std::size_t i = 0; i < kLatencyBounds_s.size(); ++i) {
    head.within[i] += latency_s <= kLatencyBounds_s[i] ? 1U : 0U;
  }
  if (head.latencies_s.size() < kKept) head.latencies_s.resize(head.latencies_s.size() + 1);
  head.latencies_s[head.next_latency++ % kKept] = latency_s;
}

// The median of the last ones.
std::optional<double> HeadWatch::latency_s(const Head& head) {
  if (head.latencies_s.empty()) return std::nullopt;
  std::vector<double> sorted = head.latencies_s;
  const auto middle = sorted.begin() + std::ssize(sorted) / 2;
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

void HeadWatch::see(const Event& event) {
  const std::lock_guard lock(mutex_);
  events_.push_back({++event_count_, event});
  if (events_.size() > kMostEvents) events_.pop_front();
}

double HeadWatch::age_s(const Head& head) { return seconds(Clock::now() - head.last); }

std::vector<ServedHead> HeadWatch::served() const {
  std::function<std::vector<ServedHead>()> ask;
  {
    const std::lock_guard lock(mutex_);
    ask = services_.heads;
  }
  return ask ? ask() : std::vector<ServedHead>();
}

std::vector<SinkReport> HeadWatch::sinks() const {
  std::function<std::vector<SinkReport>()> ask;
  {
    const std::lock_guard lock(mutex_);
    ask = services_.sinks;
  }
  return ask ? ask() : std::vector<SinkReport>();
}

std::string HeadWatch::status_json() const {
  const std::vector<ServedHead> all = served();
  const std::vector<SinkReport> all_sinks = sinks();
  const std::lock_guard lock(mutex_);
  json heads = json::array();
  for (const ServedHead& one : all) {
    const SourceStatistics& source = one.health.read.statistics;
    const auto seen = heads_.find(one.name);
    const bool is_seen = seen != heads_.end() && seen->second.scans > 0;
    const bool is_now = is_seen && one.plays.empty();  // What is played back was seen long ago.
    const auto latency = is_now ? latency_s(seen->second) : std::nullopt;
    heads.push_back({{"name", one.name},
                     {"state", to_string(one.health.state)},
                     {"source", one.source},
                     {"model", one.model.empty() ? json() : json(one.model)},
                     {"rate_hz", one.health.rate_hz},
                     {"latency_ms", latency ? json(1e3 * *latency) : json()},
                     {"dropped", source.dropped + source.overrun},
                     {"reconnects", reconnects(one.health)},
                     {"scans", one.health.scanner.counts.scans},
                     {"last_scan_s", is_seen ? json(age_s(seen->second)) : json()},
                     {"laser", is_seen ? json(seen->second.laser) : json()},
                     {"lasers", is_seen ? seen->second.lasers : 1},
                     {"plays", one.plays.empty() ? json() : json(one.plays)}});
  }
  json reports = json::array();
  for (const SinkReport& one : all_sinks) {
    reports.push_back({{"uri", one.uri},
                       {"state", to_string(one.state)},
                       {"written", one.written},
                       {"lost", one.lost}});
  }
  return dump({{"version", STRIPER_VERSION},
               {"uptime_s", seconds(Clock::now() - begin_)},
               {"heads", heads},
               {"sinks", reports}});
}

std::string HeadWatch::events_json(std::uint64_t since) const {
  const std::lock_guard lock(mutex_);
  json all = json::array();
  for (const Happened& one : events_) {
    if (one.number > since) all.push_back(event_json(one.number, one.event));
  }
  return dump(all);
}

HttpAnswer HeadWatch::readiness() const {
  const std::vector<ServedHead> all = served();
  const std::lock_guard lock(mutex_);
  json reasons = json::array();
  for (const ServedHead& one : all) {
    if (!one.plays.empty()) continue;  // It measures nothing.
    const auto seen = heads_.find(one.name);
    if (seen == heads_.end() || seen->second.scans == 0) {
      reasons.push_back(fmt::format("{}: no scan yet, {}", one.name, to_string(one.health.state)));
    } else if (Clock::now() - seen->second.last > kReadyWithin) {
      reasons.push_back(fmt::format("{}: no scan for {:.1f} s, {}", one.name, age_s(seen->second),
                                    to_string(one.health.state)));
    }
  }
  if (all.empty()) reasons.push_back("there is no head");
  HttpAnswer answer;
  answer.status = reasons.empty() ? 200 : 503;
  answer.body = dump({{"ready", reasons.empty()}, {"reasons", reasons}});
  return answer;
}

std::string HeadWatch::metrics(const WebCounts& web) const {
  const std::vector<ServedHead> all = served();
  const std::vector<SinkReport> all_sinks = sinks();
  const std::lock_guard lock(mutex_);
  Metrics m;
  m.begin("striper_build_info", "gauge", "The version that runs.");
  m.add("version", STRIPER_VERSION, 1.0);
  m.begin("striper_scans_total", "counter", "Scans that this sink was given.");
  for (const auto& [name, head] : heads_) m.add("head", name, static_cast<double>(head.scans));
  m.begin("striper_scan_age_seconds", "gauge", "Since the last scan.");
  for (const auto& [name, head] : heads_) m.add("head", name, age_s(head));
  m.begin("striper_scan_latency_seconds", "histogram",
          "From the middle of the exposure to this sink, of cameras.");
  for (const auto& [name, head] : heads_) {
    if (head.latency_count == 0) continue;
    for (std::size_t i = 0; i < kLatencyBounds_s.size(); ++i) {
      m.add_bucket(name, fmt::format("{}", kLatencyBounds_s[i]), head.within[i]);
    }
    m.add_bucket(name, "+Inf", head.latency_count);
    m.add_part("_sum", "head", name, head.latency_sum_s);
    m.add_part("_count", "head", name, static_cast<double>(head.latency_count));
  }
  m.begin("striper_valid_fraction", "gauge", "Of the last scan's returns, those that are ok.");
  for (const auto& [name, head] : heads_) m.add("head", name, head.good_part);
  m.begin("striper_range_sigma_meters", "gauge", "Median random error of the last scan's returns.");
  for (const auto& [name, head] : heads_) m.add("head", name, head.median_sigma_m);
  m.begin("striper_frame_rate_hertz", "gauge", "Frames a second, of late.");
  for (const ServedHead& one : all) m.add("head", one.name, one.health.rate_hz);
  m.begin("striper_frames_total", "counter", "Frames from the source that is open.");
  for (const ServedHead& one : all)
    m.add("head", one.name, static_cast<double>(one.health.read.frames));
  m.begin("striper_frames_dropped_total", "counter", "Frames that were lost on the way here.");
  for (const ServedHead& one : all) {
    const SourceStatistics& source = one.health.read.statistics;
    m.add("head", one.name, static_cast<double>(source.dropped + source.overrun));
  }
  m.begin("striper_reconnects_total", "counter", "Times that a lost camera came back.");
  for (const ServedHead& one : all)
    m.add("head", one.name, static_cast<double>(reconnects(one.health)));
  m.begin("striper_head_streaming", "gauge", "Whether frames come: 1 or 0.");
  for (const ServedHead& one : all)
    m.add("head", one.name, one.health.state == SourceState::kStreaming ? 1.0 : 0.0);
  m.begin("striper_dropped_total", "counter", "Scans that a sink never got.");
  for (const SinkReport& one : all_sinks) m.add("sink", one.uri, static_cast<double>(one.lost));
  m.begin("striper_clients", "gauge", "WebSockets that are open.");
  m.add(static_cast<double>(web.clients));
  m.begin("striper_client_messages_total", "counter", "Messages sent to them.");
  m.add(static_cast<double>(web.sent));
  m.begin("striper_client_dropped_total", "counter",
          "Messages that a client did not take in time.");
  m.add(static_cast<double>(web.dropped));
  m.begin("striper_http_requests_total", "counter", "Requests.");
  m.add(static_cast<double>(web.requests));
  m.begin("striper_http_refused_total", "counter", "Requests that were refused.");
  m.add(static_cast<double>(web.refused));
  return std::move(m).text();
}

}  // namespace striper::detail
