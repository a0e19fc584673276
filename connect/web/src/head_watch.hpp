// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <striper/stream/scan_sink.hpp>
#include <striper/stream/sink_services.hpp>

#include "web_desk.hpp"

namespace striper::detail {

/// What is known of the heads, as people and machines ask for it: status, events, readiness,
/// metrics. Thread-safe.
class HeadWatch {
 public:
  using Clock = std::chrono::steady_clock;

  void set_services(const SinkServices& services);
  void see(const PolarScan& scan);
  void see(const Event& event);

  /// `/api/v1/status`.
  std::string status_json() const;
  /// `/api/v1/events`: those after number `since`, of the last 1000.
  std::string events_json(std::uint64_t since) const;
  /// `/readyz`: whether every head gave a scan of late.
  HttpAnswer readiness() const;
  /// `/metrics`, Prometheus' text format 0.0.4.
  std::string metrics(const WebCounts& web) const;

 private:
  struct Head {
    std::uint64_t scans = 0;
    std::uint64_t returns = 0;
    std::uint64_t good_returns = 0;
    double good_part = 0.0;       // Of the last scan.
    double median_sigma_m = 0.0;  // Of its good returns; NaN without any.
    int laser = 0;
    Clock::time_point last;
  };
  struct Happened {
    std::uint64_t number;
    Event event;
  };

  std::vector<ServedHead> served() const;
  std::vector<SinkReport> sinks() const;
  static double age_s(const Head& head);

  mutable std::mutex mutex_;
  SinkServices services_;
  std::map<std::string, Head, std::less<>> heads_;
  std::deque<Happened> events_;
  std::uint64_t event_count_ = 0;
  std::vector<double> sigmas_m_;  // Used again.
  const Clock::time_point begin_ = Clock::now();
};

}  // namespace striper::detail
