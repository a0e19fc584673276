// SPDX-License-Identifier: Apache-2.0
#include "speed_text.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace striper::speed {
namespace {

std::string numbers(const SpeedTime& time, double megabytes) {
  return fmt::format("{:>12.1f} {:>7.1f} {:>5.0f} %", time.us, megabytes / time.us * 1e3,
                     100.0 * time.of_roof);
}

std::string to_text(const SpeedTable& table, const SpeedRow& row) {
  const double megabytes = row.pictures * table.megabytes;
  std::string text = fmt::format("  {:<34}", row.name) + numbers(row.hot, megabytes);
  if (row.streaming) text += numbers(*row.streaming, megabytes);
  return text + "\n";
}

}  // namespace

std::string to_text(const SpeedTable& table) {
  const std::string title =
      fmt::format("{}x{}, {} bits", table.size.width, table.size.height, table.bits);
  std::string text = fmt::format("{:<36}{:>12} {:>7} {:>7}{:>12} {:>7} {:>7}\n", title, "hot us",
                                 "GB/s", "roof", "stream us", "GB/s", "roof");
  for (const SpeedRow& row : table.rows) text += to_text(table, row);
  text += fmt::format(
      "  Scanner::process: {:.0f} frames/s; latency p50 {:.1f} us, p99 {:.1f} us, "
      "worst {:.0f} us, of the first frames {:.0f} us",
      table.frames_per_s, table.latency_p50_us, table.latency_p99_us, table.latency_worst_us,
      table.first_frames_worst_us);
  if (table.allocations_per_frame) {
    text += fmt::format("; {:.2f} allocations a frame", *table.allocations_per_frame);
  }
  text += fmt::format("\n  refined / fast {:.2f}", table.refined_over_fast);
  if (table.argmax_over_pass) {
    text += fmt::format("; cv::reduceArgMax / candidate pass {:.0f}", *table.argmax_over_pass);
  }
  return text + "\n";
}

nlohmann::json to_json(const SpeedTable& table) {
  nlohmann::json rows = nlohmann::json::array();
  for (const SpeedRow& row : table.rows) {
    nlohmann::json one{{"name", row.name},
                       {"pictures", row.pictures},
                       {"hot_us", row.hot.us},
                       {"hot_of_roof", row.hot.of_roof}};
    if (row.streaming) {
      one["streaming_us"] = row.streaming->us;
      one["streaming_of_roof"] = row.streaming->of_roof;
    }
    rows.push_back(std::move(one));
  }
  nlohmann::json json{{"width", table.size.width},
                      {"height", table.size.height},
                      {"bits", table.bits},
                      {"megabytes", table.megabytes},
                      {"rows", std::move(rows)},
                      {"frames_per_s", table.frames_per_s},
                      {"latency_p50_us", table.latency_p50_us},
                      {"latency_p99_us", table.latency_p99_us},
                      {"latency_worst_us", table.latency_worst_us},
                      {"first_frames_worst_us", table.first_frames_worst_us},
                      {"refined_over_fast", table.refined_over_fast}};
  if (table.argmax_over_pass) json["argmax_over_pass"] = *table.argmax_over_pass;
  if (table.allocations_per_frame) json["allocations_per_frame"] = *table.allocations_per_frame;
  return json;
}

}  // namespace striper::speed
