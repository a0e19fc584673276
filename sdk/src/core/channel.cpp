// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <utility>

#include <striper/core/channel.hpp>

namespace striper {
namespace {

constexpr std::array<std::pair<Channel, std::string_view>, 7> kWords{{
    {Channel::kAuto, "auto"},
    {Channel::kGrey, "grey"},
    {Channel::kRed, "red"},
    {Channel::kGreen, "green"},
    {Channel::kBlue, "blue"},
    {Channel::kGreenMinusRed, "green-red"},
    {Channel::kRedMinusGreen, "red-green"},
}};

}  // namespace

std::string_view to_string(Channel channel) noexcept {
  for (const auto& [value, word] : kWords) {
    if (value == channel) return word;
  }
  return {};
}

std::optional<Channel> channel_from_string(std::string_view word) noexcept {
  for (const auto& [value, text] : kWords) {
    if (text == word) return value;
  }
  return std::nullopt;
}

}  // namespace striper
