// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/illumination_pattern.hpp>

namespace striper {
namespace {

constexpr int kMaxLaserIndex = 63;

Illumination parse_entry(std::string_view entry, std::string_view text) {
  if (entry == "dark") return Illumination::dark();
  int index = -1;
  const auto [end, error] = std::from_chars(entry.data(), entry.data() + entry.size(), index);
  const bool whole = error == std::errc() && end == entry.data() + entry.size();
  if (!whole || index < 0 || index > kMaxLaserIndex) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("illumination pattern '{}': '{}' is neither 'dark' nor a laser index 0 to {}",
                    text, entry, kMaxLaserIndex));
  }
  return Illumination::laser(index);
}

}  // namespace

IlluminationPattern::IlluminationPattern(std::vector<Illumination> entries)
    : entries_(std::move(entries)) {
  const bool any_lit = std::any_of(entries_.begin(), entries_.end(),
                                   [](Illumination entry) { return entry.is_lit(); });
  const bool any_unknown = std::any_of(entries_.begin(), entries_.end(),
                                       [](Illumination entry) { return entry.is_unknown(); });
  if (!any_lit || any_unknown) {
    throw Error(ErrorKind::kUsage,
                "a illumination pattern needs at least one lit exposure and no unknown one, "
                "for example '0' or '0,dark'");
  }
}

IlluminationPattern IlluminationPattern::parse(std::string_view text) {
  if (text == "auto") return {};
  std::vector<Illumination> entries;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    entries.push_back(parse_entry(text.substr(begin, comma - begin), text));
    begin = comma + 1;
  }
  return IlluminationPattern(std::move(entries));
}

Illumination IlluminationPattern::at(std::uint64_t exposure_number) const noexcept {
  if (entries_.empty()) return Illumination::unknown();
  return entries_[exposure_number % entries_.size()];
}

bool IlluminationPattern::has_dark() const noexcept {
  return std::any_of(entries_.begin(), entries_.end(),
                     [](Illumination entry) { return entry.is_dark(); });
}

std::string IlluminationPattern::to_string() const {
  if (entries_.empty()) return "auto";
  std::string text;
  for (const Illumination entry : entries_) {
    if (!text.empty()) text += ',';
    text += entry.is_dark() ? "dark" : std::to_string(entry.laser_index());
  }
  return text;
}

}  // namespace striper
