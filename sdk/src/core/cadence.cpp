// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <utility>

#include <fmt/format.h>

#include <striper/core/cadence.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr int kMaxLaserIndex = 63;

Illumination parse_entry(std::string_view entry, std::string_view text) {
  if (entry == "dark") return Illumination::dark();
  int index = -1;
  const auto [end, error] = std::from_chars(entry.data(), entry.data() + entry.size(), index);
  const bool whole = error == std::errc() && end == entry.data() + entry.size();
  if (!whole || index < 0 || index > kMaxLaserIndex) {
    throw Error(ErrorKind::kUsage,
                fmt::format("laser cadence '{}': '{}' is neither 'dark' nor a laser index 0 to {}",
                            text, entry, kMaxLaserIndex));
  }
  return Illumination::laser(index);
}

}  // namespace

Cadence::Cadence(std::vector<Illumination> pattern) : pattern_(std::move(pattern)) {
  const bool any_lit = std::any_of(pattern_.begin(), pattern_.end(),
                                   [](Illumination entry) { return entry.is_lit(); });
  const bool any_unknown = std::any_of(pattern_.begin(), pattern_.end(),
                                       [](Illumination entry) { return entry.is_unknown(); });
  if (!any_lit || any_unknown) {
    throw Error(ErrorKind::kUsage,
                "a laser cadence needs at least one lit exposure and no unknown one, "
                "for example '0' or '0,dark'");
  }
}

Cadence Cadence::parse(std::string_view text) {
  if (text == "auto") return {};
  std::vector<Illumination> pattern;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    pattern.push_back(parse_entry(text.substr(begin, comma - begin), text));
    begin = comma + 1;
  }
  return Cadence(std::move(pattern));
}

Illumination Cadence::at(std::uint64_t exposure_number) const noexcept {
  if (pattern_.empty()) return Illumination::unknown();
  return pattern_[exposure_number % pattern_.size()];
}

bool Cadence::has_dark() const noexcept {
  return std::any_of(pattern_.begin(), pattern_.end(),
                     [](Illumination entry) { return entry.is_dark(); });
}

std::string Cadence::to_string() const {
  if (pattern_.empty()) return "auto";
  std::string text;
  for (const Illumination entry : pattern_) {
    if (!text.empty()) text += ',';
    text += entry.is_dark() ? "dark" : std::to_string(entry.laser_index());
  }
  return text;
}

}  // namespace striper
