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
constexpr double kLongestExposure_us = 1e9;

// The part of an entry behind `@`.
double parse_exposure(std::string_view entry, std::string_view text) {
  double exposure_us = 0.0;
  const auto [end, error] = std::from_chars(entry.data(), entry.data() + entry.size(), exposure_us);
  const bool is_whole = error == std::errc() && end == entry.data() + entry.size();
  if (!is_whole || !(exposure_us > 0.0 && exposure_us <= kLongestExposure_us)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("laser cadence '{}': '@{}' - expected an exposure in microseconds, "
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
    throw Error(ErrorKind::kUsage,
                fmt::format("laser cadence '{}': '{}' is neither 'dark' nor a laser index 0 to {}",
                            text, entry, kMaxLaserIndex));
  }
  return Illumination::laser(index);
}

}  // namespace

Cadence::Cadence(std::vector<Illumination> pattern) : Cadence(std::move(pattern), {}) {}

Cadence::Cadence(std::vector<Illumination> pattern, std::vector<double> exposures_us)
    : pattern_(std::move(pattern)), exposures_us_(std::move(exposures_us)) {
  const bool are_long = std::all_of(exposures_us_.begin(), exposures_us_.end(),
                                    [](double exposure_us) { return exposure_us > 0.0; });
  if (!are_long || (is_bracket() && exposures_us_.size() != pattern_.size())) {
    throw Error(ErrorKind::kUsage,
                "a laser cadence gives all of its entries an exposure, as in "
                "'0@20,dark@20,0@200,dark@200', or none");
  }
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
  std::vector<double> exposures_us;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const std::string_view entry = text.substr(begin, comma - begin);
    const std::size_t at = entry.find('@');
    pattern.push_back(parse_entry(entry.substr(0, at), text));
    if (at != std::string_view::npos) {
      exposures_us.push_back(parse_exposure(entry.substr(at + 1), text));
    }
    begin = comma + 1;
  }
  return {std::move(pattern), std::move(exposures_us)};
}

Illumination Cadence::at(std::uint64_t exposure_number) const noexcept {
  if (pattern_.empty()) return Illumination::unknown();
  return pattern_[exposure_number % pattern_.size()];
}

double Cadence::exposure_us_at(std::uint64_t exposure_number) const noexcept {
  return is_bracket() ? exposures_us_[exposure_number % exposures_us_.size()] : 0.0;
}

bool Cadence::has_dark() const noexcept {
  return std::any_of(pattern_.begin(), pattern_.end(),
                     [](Illumination entry) { return entry.is_dark(); });
}

std::string Cadence::to_string() const {
  if (pattern_.empty()) return "auto";
  std::string text;
  for (std::size_t i = 0; i < pattern_.size(); ++i) {
    if (i > 0) text += ',';
    text += pattern_[i].is_dark() ? "dark" : std::to_string(pattern_[i].laser_index());
    if (is_bracket()) text += fmt::format("@{}", exposures_us_[i]);
  }
  return text;
}

}  // namespace striper
