// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

// Whose requests are answered. A page from elsewhere, in a browser on a machine that can reach this
// one, must not read what is here: neither by its own address (Origin) nor under a name of its own
// that leads here (DNS rebinding: Host).
namespace striper::detail {

/// What a server calls itself.
struct ServerName {
  std::string address;  ///< That it listens at.
  std::uint16_t port = 0;
};

/// "127.0.0.1" of "127.0.0.1:8765", "::1" of "[::1]:8765".
std::string_view host_of(std::string_view authority) noexcept;

/// Whether `Host` is the server's address, or localhost; of a server at all addresses, any address,
/// since names are what a stranger can choose.
bool is_our_host(std::string_view host, const ServerName& server);

/// Whether `Origin` is a page of ours (http, and the same authority as `host`) or of those that
/// were allowed. Programs that are no browser send none, which is fine.
bool is_our_origin(std::string_view origin, std::string_view host,
                   std::span<const std::string> allowed);

/// The path of a request's target and the value of one key of its query ("" where it has none).
struct Target {
  std::string_view path;
  std::string_view query;

  explicit Target(std::string_view target) noexcept;
  std::string_view value(std::string_view key) const noexcept;
};

/// "a/b c" of "a%2Fb%20c"; what is no such pair of digits stays.
std::string decoded(std::string_view text);

}  // namespace striper::detail
