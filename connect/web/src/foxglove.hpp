// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <striper/stream/sink_services.hpp>

// What is said on a Foxglove WebSocket, as text and bytes: pure functions.
// Source: Foxglove, WebSocket protocol v1 (ws-protocol, docs/spec.md) and its successor in
// foxglove-sdk, which differ in the subprotocol's name alone as far as this goes.
namespace striper::detail::foxglove {

/// A topic on the wire: CDR, with the schema as ROS 2's .msg text.
struct Channel {
  std::uint32_t id = 0;
  std::string topic;
  std::string schema_name;
  std::string schema;
};

/// The first of a client's subprotocols that is known here; empty for none.
/// @param offered the header Sec-WebSocket-Protocol.
std::string_view choose_subprotocol(std::string_view offered) noexcept;

/// Something that can be called, with a request and an answer in JSON.
struct Service {
  std::uint32_t id = 0;
  std::string name;
  std::string request_schema;  ///< JSON schema.
};

std::string server_info(std::string_view name, std::string_view session);
std::string advertise(std::span<const Channel> channels);
std::string advertise(std::span<const Service> services);
/// A parameter without a value is an empty text here, since clients leave out those without any.
/// @param id of the request that this answers; empty for none.
std::string parameter_values(std::span<const Parameter> parameters, std::string_view id);
std::string service_failure(std::uint32_t service, std::uint32_t call, std::string_view why);
std::vector<std::uint8_t> service_response(std::uint32_t service, std::uint32_t call,
                                           std::string_view json);

enum class Level { kInfo = 0, kWarning = 1, kError = 2 };
/// @param id by which `remove_status` takes it back.
std::string status(Level level, std::string_view message, std::string_view id);
std::string remove_status(std::string_view id);

/// What stands before a message's bytes: opcode 1, subscription, time.
inline constexpr std::size_t kMessageHeader = 13;
std::array<std::uint8_t, kMessageHeader> message_header(std::uint32_t subscription,
                                                        std::uint64_t time_ns) noexcept;

struct Subscription {
  std::uint32_t id = 0;
  std::uint32_t channel = 0;
};

/// What a client asks for.
struct Request {
  std::string op;
  std::vector<Subscription> subscriptions;      ///< Of `subscribe`.
  std::vector<std::uint32_t> unsubscribed_ids;  ///< Of `unsubscribe`.
  std::vector<std::string> parameter_names;     ///< Of `getParameters` and its updates.
  std::vector<Parameter> parameters;            ///< Of `setParameters`.
  std::string id;                               ///< Of both, to be given back; may be empty.
};

/// @throws Error{kBadValue} saying what is wrong with it.
Request parse_request(std::string_view text);

/// A call of a service.
struct Call {
  std::uint32_t service = 0;
  std::uint32_t call = 0;
  std::string_view encoding;
  std::string_view payload;
};

/// A client's binary message, where it is a call. @throws Error{kBadValue} where it is none.
Call parse_call(std::string_view bytes);

}  // namespace striper::detail::foxglove
