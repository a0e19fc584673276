// SPDX-License-Identifier: Apache-2.0
#include "stream/files/read_number.hpp"

#include <charconv>
#include <limits>

namespace striper::detail {
namespace {

template <typename Number>
bool read_whole(std::string_view text, Number& number) noexcept {
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  return error == std::errc() && end == last;
}

}  // namespace

bool read_number(std::string_view text, double& number) noexcept {
  return read_whole(text, number);
}
bool read_number(std::string_view text, float& number) noexcept { return read_whole(text, number); }
bool read_number(std::string_view text, std::uint64_t& number) noexcept {
  return read_whole(text, number);
}
bool read_number(std::string_view text, int& number) noexcept { return read_whole(text, number); }

bool read_into(std::string_view text, const ScanColumn& column, Return& out) noexcept {
  const auto read = [&](auto member) {
    auto& value = out.*member;
    value = std::numeric_limits<std::remove_reference_t<decltype(value)>>::quiet_NaN();
    return text.empty() || read_number(text, value);
  };
  return std::visit(read, column.member);
}

}  // namespace striper::detail
