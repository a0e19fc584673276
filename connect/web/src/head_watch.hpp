// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
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
  void see(const HeadInfo& head);
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
  // Of a histogram: from a fast camera's to what a person sees.
  static constexpr std::array<double, 9> kLatencyBounds_s = {.002, .005, .01, .02, .05,
                                                             .1,   .2,   .5,  1.};
  struct Head {
    std::uint64_t scans = 0;
    std::uint64_t returns = 0;
    std::uint64_t good_returns = 0;
    double good_part = 0.0;       // Of the last scan.
    double median_sigma_m = 0.0;  // Of its good returns; NaN without any.
    int laser = 0;
    std::size_t lasers = 1;           // That its model has.
    std::vector<double> latencies_s;  // From the middle of the exposure to here: the last of them.
    std::size_t next_latency = 0;
    double latency_sum_s = 0.0;
    std::uint64_t latency_count = 0;
    std::array<std::uint64_t, kLatencyBounds_s.size()> within{};
    Clock::time_point last;
  };
  struct Happened {
    std::uint64_t number;
    Event event;
  };

  Head& head_of(std::string_view name);
  std::vector<ServedHead> served() const;
  std::vector<SinkReport> sinks() const;
  static void note_latency(Head& head, const FrameTime& time);
  static std::optional<double> latency_s(const Head& head);
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
