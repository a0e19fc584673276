// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <linux/videodev2.h>

namespace striper::detail::v4l2 {

// The words that a source's address has for the kernel's television standards and orders of fields.

/// `ntsc`, `pal-60`, ... -> the kernel's bits. @return 0 for a word that is none.
v4l2_std_id standard_from_string(std::string_view word) noexcept;
std::string standard_to_string(v4l2_std_id standard);

/// The words for all standards among these bits.
std::vector<std::string> standards_to_strings(v4l2_std_id standards);

/// `interlaced-tb` <-> V4L2_FIELD_INTERLACED_TB; V4L2_FIELD_ANY for a word that is none.
std::uint32_t field_from_string(std::string_view word) noexcept;
std::string field_to_string(std::uint32_t field);

/// Whether two words are the same but for capital letters.
bool is_same_word(std::string_view a, std::string_view b) noexcept;

}  // namespace striper::detail::v4l2
