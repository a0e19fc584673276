// SPDX-License-Identifier: Apache-2.0
#include "foxglove.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>

#include "parameter_json.hpp"

namespace striper::detail::foxglove {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 2> kSubprotocols = {"foxglove.websocket.v1",
                                                           "foxglove.sdk.v1"};

constexpr char kServiceRequest = 2;
constexpr std::uint8_t kServiceResponse = 3;
constexpr std::string_view kEncoding = "json";
constexpr const char* kResponseSchema =
    R"({"type":"object","properties":{"message":{"type":"string"}}})";

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

std::string text_of(const json& value, const char* name) {
  if (!value.is_string()) refuse(fmt::format("{} is no text", name));
  return value.get<std::string>();
}

// One without a value, or with an empty one, has its default again.
Parameter parameter(const json& value) {
  const std::string name = text_of(member(value, "name"), "name");
  const bool has_value = value.contains("value") && value["value"] != "";
  return has_value ? parameter_of(name, value["value"]) : Parameter{name, {}};
}

void add_u32(std::vector<std::uint8_t>& bytes, std::uint32_t number) {
  for (std::size_t i = 0; i < 4; ++i) bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
}

std::uint32_t take_u32(std::string_view& bytes) {
  if (bytes.size() < 4) refuse("a call of a service is cut off");
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    number |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
  }
  bytes.remove_prefix(4);
  return number;
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
  return dump_json({{"op", "serverInfo"},
                    {"name", name},
                    {"capabilities", {"parameters", "parametersSubscribe", "services"}},
                    {"supportedEncodings", json::array({"json"})},
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
  return dump_json({{"op", "advertise"}, {"channels", all}});
}

std::string advertise(std::span<const Service> services) {
  json all = json::array();
  const auto schema = [](const std::string& name, const std::string& text) {
    return json{{"encoding", "json"},
                {"schemaName", name},
                {"schemaEncoding", "jsonschema"},
                {"schema", text}};
  };
  for (const Service& one : services) {
    const std::string type = "striper/" + one.name.substr(one.name.rfind('/') + 1);
    all.push_back({{"id", one.id},
                   {"name", one.name},
                   {"type", type},
                   {"request", schema(type + "_Request", one.request_schema)},
                   {"response", schema(type + "_Response", kResponseSchema)}});
  }
  return dump_json({{"op", "advertiseServices"}, {"services", all}});
}

std::string parameter_values(std::span<const Parameter> parameters, std::string_view id) {
  json all = json::array();
  for (const Parameter& one : parameters) {
    json made = {{"name", one.name}, {"value", to_json(one.value)}};
    if (made["value"].is_null()) made["value"] = "";
    if (made["value"].is_number()) made["type"] = "float64";
    if (made["value"].is_array()) made["type"] = "float64_array";
    all.push_back(std::move(made));
  }
  json whole = {{"op", "parameterValues"}, {"parameters", all}};
  if (!id.empty()) whole["id"] = id;
  return dump_json(whole);
}

std::string service_failure(std::uint32_t service, std::uint32_t call, std::string_view why) {
  return dump_json(
      {{"op", "serviceCallFailure"}, {"serviceId", service}, {"callId", call}, {"message", why}});
}

std::vector<std::uint8_t> service_response(std::uint32_t service, std::uint32_t call,
                                           std::string_view json) {
  std::vector<std::uint8_t> bytes{kServiceResponse};
  add_u32(bytes, service);
  add_u32(bytes, call);
  add_u32(bytes, static_cast<std::uint32_t>(kEncoding.size()));
  bytes.insert(bytes.end(), kEncoding.begin(), kEncoding.end());
  bytes.insert(bytes.end(), json.begin(), json.end());
  return bytes;
}

std::string status(Level level, std::string_view message, std::string_view id) {
  return dump_json(
      {{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}, {"id", id}});
}

std::string remove_status(std::string_view id) {
  return dump_json({{"op", "removeStatus"}, {"statusIds", json::array({id})}});
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
  const json whole = parse_json(text);
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
  } else if (request.op == "setParameters") {
    for (const json& one : list(whole, "parameters")) request.parameters.push_back(parameter(one));
  } else if (request.op.ends_with("Parameters") || request.op.ends_with("ParameterUpdates")) {
    for (const json& one : list(whole, "parameterNames")) {
      request.parameter_names.push_back(text_of(one, "parameterNames"));
    }
  }
  if (whole.contains("id")) request.id = text_of(whole["id"], "id");
  return request;
}

Call parse_call(std::string_view bytes) {
  if (bytes.empty() || bytes[0] != kServiceRequest) refuse("this is no call of a service");
  bytes.remove_prefix(1);
  Call call;
  call.service = take_u32(bytes);
  call.call = take_u32(bytes);
  const std::uint32_t size = take_u32(bytes);
  if (size > bytes.size()) refuse("a call of a service is cut off");
  call.encoding = bytes.substr(0, size);
  call.payload = bytes.substr(size);
  return call;
}

}  // namespace striper::detail::foxglove
