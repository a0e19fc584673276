// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "foxglove.hpp"

namespace striper::detail {

/// What somebody asks by HTTP, whose Host, Origin, size and rate are in order.
struct HttpAsk {
  std::string method;  ///< GET, HEAD, POST or PUT.
  std::string target;  ///< "/api/v1/events?since=17".
  std::string body;
  bool has_token = false;
};

struct HttpAnswer {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body;
  std::string file{};    ///< Where the body is, in place of `body`; empty for none.
  std::string cookie{};  ///< Set-Cookie; empty for none.
  std::string allow{};   ///< Of 405: the methods that there are.
};

/// How a server's clients are.
struct WebCounts {
  std::uint64_t clients = 0;   ///< WebSockets that are open.
  std::uint64_t sent = 0;      ///< Messages.
  std::uint64_t dropped = 0;   ///< Messages that a client did not take in time.
  std::uint64_t requests = 0;  ///< Of HTTP, answered or refused.
  std::uint64_t refused = 0;
};

/// What is behind a WebServer: it knows the answers, the server knows who may hear them.
class WebDesk {
 public:
  WebDesk() = default;
  WebDesk(const WebDesk&) = delete;
  WebDesk& operator=(const WebDesk&) = delete;
  virtual ~WebDesk() = default;

  /// The secret of those who may change something; empty: nobody may. Any thread.
  virtual std::string token() const = 0;
  /// Somebody at that address showed a wrong secret. On the server's thread.
  virtual void note_refusal(const std::string& address) = 0;
  /// Whether answering takes as long as a camera takes. Any thread.
  virtual bool is_slow(const HttpAsk& ask) const = 0;
  /// Whether it is a command that anybody may give at any time: no secret is asked for, no rate is
  /// limited, and nothing that others ask is before it. Any thread.
  virtual bool is_free_to_all(const HttpAsk& ask) const = 0;
  virtual bool is_free_to_all(std::uint32_t service) const = 0;
  /// On the server's thread; where it is slow, on that of slow answers, or of what is free to all.
  virtual HttpAnswer answer(const HttpAsk& ask) = 0;

  /// Of the Foxglove WebSocket, on the server's thread.
  virtual std::vector<foxglove::Service> services() const = 0;

  // On the thread of slow answers; `call` of what is free to all on its own. Names are
  // "/HEAD/NAME". @throws Error.
  virtual std::vector<Parameter> parameters(std::span<const std::string> names) = 0;
  virtual void set_parameter(const Parameter& wanted) = 0;
  /// @return the answer, as JSON.
  virtual std::string call(std::uint32_t service, std::string_view request, bool has_token) = 0;
};

}  // namespace striper::detail
