// SPDX-License-Identifier: Apache-2.0
#include "foxglove.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>

namespace striper::detail::foxglove {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 2> kSubprotocols = {"foxglove.websocket.v1",
                                                           "foxglove.sdk.v1"};

// Texts of others may be no UTF-8, which must not end a connection.
std::string dump(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string_view trimmed(std::string_view text) noexcept {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

[[noreturn]] void refuse(const std::string& what) { throw Error(ErrorKind::kBadValue, what); }

std::uint32_t id_of(const json& value, std::string_view field) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > UINT32_MAX) {
    refuse(fmt::format("{} is a {} where a number of 32 bits is expected", field,
                       value.is_number() ? "number out of range" : value.type_name()));
  }
  return value.get<std::uint32_t>();
}

const json& member(const json& object, const char* name) {
  const auto found = object.is_object() ? object.find(name) : object.end();
  if (!object.is_object() || found == object.end()) refuse(fmt::format("there is no {}", name));
  return *found;
}

const json& list(const json& object, const char* name) {
  constexpr std::size_t kMost = 1000;  // More than there are topics.
  const json& found = member(object, name);
  if (!found.is_array() || found.size() > kMost) {
    refuse(fmt::format("{} is no list of at most {}", name, kMost));
  }
  return found;
}

}  // namespace

std::string_view choose_subprotocol(std::string_view offered) noexcept {
  while (!offered.empty()) {
    const std::string_view one = offered.substr(0, offered.find(','));
    offered.remove_prefix(std::min(offered.size(), one.size() + 1));
    const auto known = std::find(kSubprotocols.begin(), kSubprotocols.end(), trimmed(one));
    if (known != kSubprotocols.end()) return *known;
  }
  return {};
}

std::string server_info(std::string_view name, std::string_view session) {
  return dump({{"op", "serverInfo"},
               {"name", name},
               {"capabilities", json::array()},
               {"supportedEncodings", json::array()},
               {"metadata", json::object()},
               {"sessionId", session}});
}

std::string advertise(std::span<const Channel> channels) {
  json all = json::array();
  for (const Channel& one : channels) {
    all.push_back({{"id", one.id},
                   {"topic", one.topic},
                   {"encoding", "cdr"},
                   {"schemaName", one.schema_name},
                   {"schema", one.schema},
                   {"schemaEncoding", "ros2msg"}});
  }
  return dump({{"op", "advertise"}, {"channels", all}});
}

std::string status(Level level, std::string_view message, std::string_view id) {
  return dump(
      {{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}, {"id", id}});
}

std::string remove_status(std::string_view id) {
  return dump({{"op", "removeStatus"}, {"statusIds", json::array({id})}});
}

std::array<std::uint8_t, kMessageHeader> message_header(std::uint32_t subscription,
                                                        std::uint64_t time_ns) noexcept {
  std::array<std::uint8_t, kMessageHeader> header{1};
  for (std::size_t i = 0; i < 4; ++i)
    header[1 + i] = static_cast<std::uint8_t>(subscription >> (8 * i));
  for (std::size_t i = 0; i < 8; ++i) header[5 + i] = static_cast<std::uint8_t>(time_ns >> (8 * i));
  return header;
}

Request parse_request(std::string_view text) {
  const auto refuse_deep = [](int depth, json::parse_event_t, json&) {
    constexpr int kDeepest = 16;  // Nothing that clients say is deeper than 4.
    if (depth > kDeepest) refuse(fmt::format("this JSON is nested more than {} deep", kDeepest));
    return true;
  };
  const json whole = json::parse(text, refuse_deep, false);
  if (whole.is_discarded()) refuse("this is no JSON");
  const json& op = member(whole, "op");
  if (!op.is_string()) refuse("op is no text");
  Request request;
  request.op = op.get<std::string>();
  if (request.op == "subscribe") {
    for (const json& one : list(whole, "subscriptions")) {
      request.subscriptions.push_back(
          {id_of(member(one, "id"), "id"), id_of(member(one, "channelId"), "channelId")});
    }
  } else if (request.op == "unsubscribe") {
    for (const json& one : list(whole, "subscriptionIds")) {
      request.unsubscribed_ids.push_back(id_of(one, "subscriptionIds"));
    }
  }
  return request;
}

}  // namespace striper::detail::foxglove
