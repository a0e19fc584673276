// SPDX-License-Identifier: Apache-2.0
#include "record/info_json.hpp"

#include <optional>

#include <nlohmann/json.hpp>

namespace striper::program {
namespace {

nlohmann::json to_json(const TopicInfo& topic) {
  return {{"name", topic.name},
          {"type", topic.type},
          {"count", topic.count},
          {"rate_hz", topic.rate_hz()},
          {"largest_gap_s", topic.largest_gap_s}};
}

template <typename Number>
nlohmann::json or_null(const std::optional<Number>& number) {
  return number ? nlohmann::json(*number) : nlohmann::json(nullptr);
}

}  // namespace

nlohmann::json to_json(const RecordingInfo& info) {
  nlohmann::json json{{"format", info.format}, {"bytes", info.bytes},
                      {"heads", info.heads},   {"frames", info.frames},
                      {"scans", info.scans},   {"lasers", info.lasers},
                      {"damage", nullptr},     {"duration_s", info.duration_s}};
  json["start_s"] = or_null(info.start_s);
  json["topics"] = nlohmann::json::array();
  for (const TopicInfo& topic : info.topics) json["topics"].push_back(to_json(topic));
  json["model"] = nullptr;
  for (const auto& [head, attachment] : info.models) json["model"][head] = attachment;
  if (info.damages.empty()) return json;
  const RecordingDamage& first = info.damages.front();
  json["damage"] = {{"offset", or_null(first.offset)},
                    {"reason", first.reason},
                    {"lost_bytes", or_null(info.lost_bytes())},
                    {"places", info.damages.size()}};
  return json;
}

}  // namespace striper::program
