// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace striper {

/// What of a colour image is searched for the stripe. On grey images all of them are the grey
/// value.
///
/// The differences subtract white light. A stripe that is bright enough to clip to white they
/// hollow out; that is corrected where it is scanned, and shows no more than its own colour does.
enum class Channel { kAuto, kGrey, kRed, kGreen, kBlue, kGreenMinusRed, kRedMinusGreen };

/// Whether one colour is subtracted from another.
constexpr bool is_colour_difference(Channel channel) noexcept {
  return channel == Channel::kGreenMinusRed || channel == Channel::kRedMinusGreen;
}

/// `auto`, `grey`, `red`, `green`, `blue`, `green-red`, `red-green`. Static storage.
std::string_view to_string(Channel channel) noexcept;

/// The inverse; empty for a word that is none of them.
std::optional<Channel> channel_from_string(std::string_view word) noexcept;

}  // namespace striper
