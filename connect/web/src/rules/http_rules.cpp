// SPDX-License-Identifier: Apache-2.0
#include "rules/http_rules.hpp"

#include <algorithm>
#include <charconv>

#include <arpa/inet.h>
#include <fmt/format.h>

namespace striper::detail {
namespace {

bool is_literal(std::string_view host) {
  const std::string text(host);
  in6_addr parsed{};
  return ::inet_pton(AF_INET, text.c_str(), &parsed) == 1 ||
         ::inet_pton(AF_INET6, text.c_str(), &parsed) == 1;
}

bool is_loopback(std::string_view host) {
  return host == "localhost" || host == "::1" || (host.starts_with("127.") && is_literal(host));
}

}  // namespace

std::string_view host_of(std::string_view authority) noexcept {
  if (authority.starts_with('[')) {
    const std::size_t end = authority.find(']');
    return end == std::string_view::npos ? std::string_view() : authority.substr(1, end - 1);
  }
  return authority.substr(0, authority.find(':'));
}

bool is_our_host(std::string_view host, const ServerName& server) {
  const std::string_view name = host_of(host);
  const std::string port = fmt::format(":{}", server.port);
  const bool has_port = name.size() != host.size() && !host.ends_with(']');
  if (has_port && !host.ends_with(port)) return false;
  if (name == server.address) return true;
  const bool is_everywhere = server.address == "0.0.0.0" || server.address == "::";
  if (is_everywhere) return is_literal(name) || name == "localhost";
  return is_loopback(name) && is_loopback(server.address);
}

bool is_our_origin(std::string_view origin, std::string_view host,
                   std::span<const std::string> allowed) {
  if (origin.empty()) return true;
  constexpr std::string_view kScheme = "http://";
  if (origin.starts_with(kScheme) && origin.substr(kScheme.size()) == host) return true;
  return std::find(allowed.begin(), allowed.end(), origin) != allowed.end();
}

Target::Target(std::string_view target) noexcept
    : path(target.substr(0, target.find('?'))),
      query(path.size() < target.size() ? target.substr(path.size() + 1) : std::string_view()) {}

std::string_view Target::value(std::string_view key) const noexcept {
  std::string_view rest = query;
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    const std::size_t equals = pair.find('=');
    if (pair.substr(0, equals) != key) continue;
    return equals == std::string_view::npos ? std::string_view() : pair.substr(equals + 1);
  }
  return {};
}

std::string decoded(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned char byte = 0;
    const bool is_pair = text[i] == '%' && i + 2 < text.size();
    const char* const end = text.data() + i + 3;
    if (is_pair && std::from_chars(end - 2, end, byte, 16).ptr == end) {
      plain += static_cast<char>(byte);
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

}  // namespace striper::detail
