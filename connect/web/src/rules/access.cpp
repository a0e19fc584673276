// SPDX-License-Identifier: Apache-2.0
#include "rules/access.hpp"

#include <algorithm>

namespace striper::detail {
namespace {

constexpr std::size_t kMostAddresses = 1024;

std::string_view of_cookie(std::string_view header) noexcept {
  while (!header.empty()) {
    std::string_view one = header.substr(0, header.find(';'));
    header.remove_prefix(std::min(header.size(), one.size() + 1));
    one.remove_prefix(std::min(one.size(), one.find_first_not_of(' ')));
    const std::size_t equals = one.find('=');
    const bool is_ours = equals != std::string_view::npos && one.substr(0, equals) == kTokenCookie;
    if (is_ours) return one.substr(equals + 1);
  }
  return {};
}

}  // namespace

std::string_view ShownToken::text() const noexcept {
  constexpr std::string_view kBearer = "Bearer ";
  if (authorization.starts_with(kBearer)) return authorization.substr(kBearer.size());
  const std::string_view of_browser = of_cookie(cookie);
  return of_browser.empty() ? query : of_browser;
}

bool is_same_secret(std::string_view a, std::string_view b) noexcept {
  unsigned differences = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < b.size(); ++i) {
    const char other = a.empty() ? '\0' : a[i % a.size()];
    differences |= static_cast<unsigned char>(other) ^ static_cast<unsigned char>(b[i]);
  }
  return differences == 0U;
}

RateLimit::RateLimit(double per_second, double at_once) noexcept
    : per_second_(per_second), at_once_(at_once), left_(at_once) {}

bool RateLimit::take(Clock::time_point now) noexcept {
  const double passed_s = std::chrono::duration<double>(now - last_).count();
  last_ = now;
  left_ = std::min(at_once_, left_ + per_second_ * passed_s);
  if (left_ < 1.0) return false;
  left_ -= 1.0;
  return true;
}

AddressLimits::AddressLimits(double per_second, double at_once) noexcept
    : per_second_(per_second), at_once_(at_once) {}

bool AddressLimits::take(const std::string& address, RateLimit::Clock::time_point now) {
  if (by_address_.size() >= kMostAddresses) by_address_.clear();
  return by_address_.try_emplace(address, per_second_, at_once_).first->second.take(now);
}

}  // namespace striper::detail
