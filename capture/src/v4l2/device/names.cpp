// SPDX-License-Identifier: Apache-2.0
#include "v4l2/device/names.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include <fmt/format.h>

namespace striper::detail::v4l2 {
namespace {

struct StandardName {
  std::string_view word;
  v4l2_std_id bits;
};

constexpr std::array kStandards{
    StandardName{"ntsc", V4L2_STD_NTSC},
    StandardName{"ntsc-m", V4L2_STD_NTSC_M},
    StandardName{"ntsc-j", V4L2_STD_NTSC_M_JP},
    StandardName{"ntsc-m-jp", V4L2_STD_NTSC_M_JP},
    StandardName{"ntsc-m-kr", V4L2_STD_NTSC_M_KR},
    StandardName{"ntsc-443", V4L2_STD_NTSC_443},
    StandardName{"pal", V4L2_STD_PAL},
    StandardName{"pal-bg", V4L2_STD_PAL_BG},
    StandardName{"pal-i", V4L2_STD_PAL_I},
    StandardName{"pal-dk", V4L2_STD_PAL_DK},
    StandardName{"pal-m", V4L2_STD_PAL_M},
    StandardName{"pal-n", V4L2_STD_PAL_N},
    StandardName{"pal-nc", V4L2_STD_PAL_Nc},
    StandardName{"pal-60", V4L2_STD_PAL_60},
    StandardName{"secam", V4L2_STD_SECAM},
};

struct FieldName {
  std::string_view word;
  std::uint32_t field;
};

constexpr std::array kFields{
    FieldName{"none", V4L2_FIELD_NONE},
    FieldName{"top", V4L2_FIELD_TOP},
    FieldName{"bottom", V4L2_FIELD_BOTTOM},
    FieldName{"interlaced", V4L2_FIELD_INTERLACED},
    FieldName{"seq-tb", V4L2_FIELD_SEQ_TB},
    FieldName{"seq-bt", V4L2_FIELD_SEQ_BT},
    FieldName{"alternate", V4L2_FIELD_ALTERNATE},
    FieldName{"interlaced-tb", V4L2_FIELD_INTERLACED_TB},
    FieldName{"interlaced-bt", V4L2_FIELD_INTERLACED_BT},
};

}  // namespace

bool is_same_word(std::string_view a, std::string_view b) noexcept {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
    return std::tolower(x) == std::tolower(y);
  });
}

v4l2_std_id standard_from_string(std::string_view word) noexcept {
  const auto* const found =
      std::find_if(kStandards.begin(), kStandards.end(),
                   [&](const auto& name) { return is_same_word(name.word, word); });
  return found == kStandards.end() ? 0 : found->bits;
}

std::string standard_to_string(v4l2_std_id standard) {
  for (const StandardName& name : kStandards) {
    if (name.bits == standard) return std::string(name.word);
  }
  for (const StandardName& name : kStandards) {
    if ((name.bits & standard) != 0) return std::string(name.word);
  }
  return (standard & V4L2_STD_525_60) != 0 ? "525 lines" : "625 lines";
}

std::vector<std::string> standards_to_strings(v4l2_std_id standards) {
  std::vector<std::string> words;
  words.reserve(kStandards.size());
  for (const StandardName& name : kStandards) {
    if ((name.bits & standards) != 0) words.emplace_back(name.word);
  }
  return words;
}

std::uint32_t field_from_string(std::string_view word) noexcept {
  const auto* const found = std::find_if(kFields.begin(), kFields.end(), [&](const auto& name) {
    return is_same_word(name.word, word);
  });
  return found == kFields.end() ? std::uint32_t{V4L2_FIELD_ANY} : found->field;
}

std::string field_to_string(std::uint32_t field) {
  const auto* const found = std::find_if(kFields.begin(), kFields.end(),
                                         [&](const auto& name) { return name.field == field; });
  return found == kFields.end() ? fmt::format("field order {}", field) : std::string(found->word);
}

}  // namespace striper::detail::v4l2
