// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "client_outbox.hpp"
#include "foxglove.hpp"
#include "http_rules.hpp"
#include "web_address.hpp"

namespace striper::detail {

struct HttpAnswer {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body;
};

/// How the server's clients are.
struct WebCounts {
  std::uint64_t clients = 0;   ///< WebSockets that are open.
  std::uint64_t sent = 0;      ///< Messages.
  std::uint64_t dropped = 0;   ///< Messages that a client did not take in time.
  std::uint64_t requests = 0;  ///< Of HTTP, answered or refused.
  std::uint64_t refused = 0;
};

/// One port for pages, answers and the Foxglove WebSocket, on a thread of its own (Boost.Beast).
///
/// Whoever asks has bounded room and time: 8 kB of header, no body, 10 s to say it, 64 kB a message
/// of a WebSocket, 64 connections. A client that does not read is told so, and is dropped when it
/// has not answered a ping for 30 s.
///
/// Thread-safe. Publishing never waits: it hands over the newest message of a channel.
class WebServer {
 public:
  /// Answers GET and HEAD; called on the server's thread.
  using Answerer = std::function<HttpAnswer(const Target& target)>;

  /// Listens. @throws Error{kIo} where that address or port cannot be had.
  WebServer(const WebAddress& address, Answerer answer);
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  ~WebServer();  ///< Stops.

  const ServerName& name() const noexcept;
  /// "http://127.0.0.1:8765/".
  std::string url() const;

  /// Offers a channel to all clients, now and later. @return its number.
  /// @param is_latched late subscribers get the last message.
  std::uint32_t add_channel(const std::string& topic, const std::string& schema_name,
                            const std::string& schema, bool is_latched);
  bool is_wanted(std::uint32_t channel) const;
  void publish(std::uint32_t channel, SharedPayload payload);

  WebCounts counts() const;

  /// Says good-bye to all clients; nothing is answered any more.
  void stop() noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper::detail
