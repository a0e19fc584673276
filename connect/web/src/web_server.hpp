// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "client_outbox.hpp"
#include "rules/http_rules.hpp"
#include "web_address.hpp"
#include "web_desk.hpp"

namespace striper::detail {

/// One port for pages, answers and the Foxglove WebSocket, on a thread of its own (Boost.Beast).
///
/// Whoever asks has bounded room and time: 8 kB of header, 16 kB of body, 10 s to say it, 64 kB a
/// message of a WebSocket, 64 connections and 100 WebSockets, of each address 20
/// changes a second, and a wrong secret in six seconds after the tenth. A client that does not read
/// is told so, and is dropped when it has not answered a ping for 30 s.
///
/// What asks a camera is done on another thread, one after the other, and nobody else waits for it.
///
/// Thread-safe. Publishing never waits: it hands over the newest message of a channel.
class WebServer {
 public:
  /// Listens. @param desk outlives the server. @throws Error{kIo} where that address or port cannot
  /// be had.
  WebServer(const WebAddress& address, WebDesk& desk);
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
