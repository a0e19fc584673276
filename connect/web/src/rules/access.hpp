// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <string_view>

// Who may change something: whoever shows the secret.
namespace striper::detail {

/// Where a secret may stand in what somebody asks.
struct ShownToken {
  std::string_view authorization;  ///< The header: "Bearer T".
  std::string_view cookie;         ///< The header: "a=b; striper_token=T".
  std::string_view query;          ///< The value of `token` in a WebSocket's target.

  /// The first of them that is there; empty for none.
  std::string_view text() const noexcept;
};

inline constexpr std::string_view kTokenCookie = "striper_token";

/// Whether two secrets are the same, in a time that does not tell where they differ.
bool is_same_secret(std::string_view a, std::string_view b) noexcept;

/// So many at once, and so many a second from then on.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;

  RateLimit(double per_second, double at_once) noexcept;
  /// Whether one more is allowed now.
  bool take(Clock::time_point now) noexcept;

 private:
  double per_second_;
  double at_once_;
  double left_;
  Clock::time_point last_;
};

/// The same for each address by itself, so that nobody uses up another's. Remembers a bounded
/// number of addresses.
class AddressLimits {
 public:
  AddressLimits(double per_second, double at_once) noexcept;
  bool take(const std::string& address, RateLimit::Clock::time_point now);

 private:
  double per_second_;
  double at_once_;
  std::map<std::string, RateLimit> by_address_;
};

}  // namespace striper::detail
