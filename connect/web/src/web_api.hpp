// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/stream/scan_sink.hpp>
#include <striper/stream/sink_services.hpp>

#include "head_watch.hpp"
#include "scan_pieces.hpp"
#include "web_desk.hpp"

namespace striper::detail {

/// What is at which address, and what is done there: pages, `/api/v1`, readiness, metrics;
/// parameters and services of the Foxglove WebSocket. Thread-safe.
///
/// Whoever may look may switch lasers off. Anything else that changes something needs the secret;
/// what the program does not allow is refused even then.
class WebApi : public WebDesk {
 public:
  /// @param watch outlives this, as do the pieces. @param counts how the server's clients are.
  WebApi(const HeadWatch& watch, ScanPieces& pieces, std::function<WebCounts()> counts);

  /// Asks for the secret. @throws Error where it cannot be had.
  void set_services(const SinkServices& services);
  void set_events(const EventPort& events);
  void see(const HeadInfo& head);

  std::string token() const override;
  void note_refusal(const std::string& address) override;
  bool is_slow(const HttpAsk& ask) const override;
  bool is_free_to_all(const HttpAsk& ask) const override;
  bool is_free_to_all(std::uint32_t service) const override;
  HttpAnswer answer(const HttpAsk& ask) override;
  std::vector<foxglove::Service> services() const override;
  std::vector<Parameter> parameters(std::span<const std::string> names) override;
  void set_parameter(const Parameter& wanted) override;
  std::string call(std::uint32_t service, std::string_view request, bool has_token) override;

 private:
  HttpAnswer look(const HttpAsk& ask);
  HttpAnswer change(const HttpAsk& ask);
  HttpAnswer login(const HttpAsk& ask) const;
  HttpAnswer answer_of_head(const HttpAsk& ask);
  HttpAnswer look_at_head(const std::string& head, std::string_view word) const;
  HttpAnswer parameters_of(const HttpAsk& ask, const std::string& head);
  HttpAnswer command_of(const HttpAsk& ask, const std::string& head, std::string_view word);
  HttpAnswer model(const std::string& head) const;
  HttpAnswer recordings() const;
  HttpAnswer recording(const HttpAsk& ask) const;
  HttpAnswer play(const HttpAsk& ask, const std::string& name) const;
  HttpAnswer pieces(std::string_view head, std::string_view laser);
  HttpAnswer why(const HttpAsk& ask) const;
  SinkServices asked() const;
  std::vector<std::string> heads() const;

  const HeadWatch& watch_;
  ScanPieces& pieces_;
  const std::function<WebCounts()> counts_;
  mutable std::mutex mutex_;  // Guards what follows.
  SinkServices services_;
  EventPort events_;
  std::string token_;
  std::vector<HeadInfo> opened_;
};

}  // namespace striper::detail
