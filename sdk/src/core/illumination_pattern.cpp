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
constexpr double kLongestExposure_us = 1e9;

// The part of an entry behind `@`.
double parse_exposure(std::string_view entry, std::string_view text) {
  double exposure_us = 0.0;
  const auto [end, error] = std::from_chars(entry.data(), entry.data() + entry.size(), exposure_us);
  const bool is_whole = error == std::errc() && end == entry.data() + entry.size();
  if (!is_whole || !(exposure_us > 0.0 && exposure_us <= kLongestExposure_us)) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("illumination pattern '{}': '@{}' - expected an exposure in microseconds, "
                    "more than 0 and at most {:.0f}",
                    text, entry, kLongestExposure_us));
  }
  return exposure_us;
}

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
    : IlluminationPattern(std::move(entries), {}) {}

IlluminationPattern::IlluminationPattern(std::vector<Illumination> entries,
                                         std::vector<double> exposures_us)
    : entries_(std::move(entries)), exposures_us_(std::move(exposures_us)) {
  const bool are_long = std::all_of(exposures_us_.begin(), exposures_us_.end(),
                                    [](double exposure_us) { return exposure_us > 0.0; });
  if (!are_long || (is_bracket() && exposures_us_.size() != entries_.size())) {
    throw Error(ErrorKind::kUsage,
                "an illumination pattern gives all of its entries an exposure, as in "
                "'0@20,dark@20,0@200,dark@200', or none");
  }
  const bool any_lit = std::any_of(entries_.begin(), entries_.end(),
                                   [](Illumination entry) { return entry.is_lit(); });
  const bool any_unknown = std::any_of(entries_.begin(), entries_.end(),
                                       [](Illumination entry) { return entry.is_unknown(); });
  if (!any_lit || any_unknown) {
    throw Error(ErrorKind::kUsage,
                "an illumination pattern needs at least one lit exposure and no unknown one, "
                "for example '0' or '0,dark'");
  }
}

IlluminationPattern IlluminationPattern::parse(std::string_view text) {
  if (text == "auto") return {};
  std::vector<Illumination> entries;
  std::vector<double> exposures_us;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const std::string_view entry = text.substr(begin, comma - begin);
    const std::size_t at = entry.find('@');
    entries.push_back(parse_entry(entry.substr(0, at), text));
    if (at != std::string_view::npos) {
      exposures_us.push_back(parse_exposure(entry.substr(at + 1), text));
    }
    begin = comma + 1;
  }
  return {std::move(entries), std::move(exposures_us)};
}

Illumination IlluminationPattern::at(std::uint64_t exposure_number) const noexcept {
  if (entries_.empty()) return Illumination::unknown();
  return entries_[exposure_number % entries_.size()];
}

double IlluminationPattern::exposure_us_at(std::uint64_t exposure_number) const noexcept {
  return is_bracket() ? exposures_us_[exposure_number % exposures_us_.size()] : 0.0;
}

bool IlluminationPattern::has_dark() const noexcept {
  return std::any_of(entries_.begin(), entries_.end(),
                     [](Illumination entry) { return entry.is_dark(); });
}

std::string IlluminationPattern::to_string() const {
  if (entries_.empty()) return "auto";
  std::string text;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (i > 0) text += ',';
    text += entries_[i].is_dark() ? "dark" : std::to_string(entries_[i].laser_index());
    if (is_bracket()) text += fmt::format("@{}", exposures_us_[i]);
  }
  return text;
}

}  // namespace striper
