// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/pattern_rules.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace striper::detail {

bool agree(const IlluminationPattern& a, const IlluminationPattern& b) {
  const std::uint64_t whole = a.entries().size() * b.entries().size();
  for (std::uint64_t n = 0; n < whole; ++n) {
    if (a.at(n).is_dark() != b.at(n).is_dark()) return false;
  }
  return true;
}

std::optional<IlluminationPattern> turned_to(const IlluminationPattern& pattern,
                                             const IlluminationPattern& found) {
  std::optional<IlluminationPattern> only;
  std::vector<Illumination> entries = pattern.entries();
  for (std::size_t turn = 0; turn < entries.size(); ++turn) {
    std::rotate(entries.begin(), entries.begin() + 1, entries.end());
    const IlluminationPattern turned(entries);
    if (!agree(turned, found)) continue;
    for (std::size_t n = 0; only && n < entries.size(); ++n) {
      if (turned.at(n) != only->at(n)) return std::nullopt;
    }
    only = turned;
  }
  return only;
}

bool has_dark_of_same_rows(const IlluminationPattern& pattern) {
  const std::uint64_t whole = 2 * pattern.entries().size();  // An odd period meets both parities.
  for (std::uint64_t parity = 0; parity < 2; ++parity) {
    bool is_lit = false;
    bool is_dark = false;
    for (std::uint64_t n = parity; n < whole; n += 2) {
      (pattern.at(n).is_dark() ? is_dark : is_lit) = true;
    }
    if (is_lit && !is_dark) return false;
  }
  return true;
}

IlluminationPattern pattern_of_labels(const HeldExposures& held) {
  constexpr std::size_t kLongest = 8;
  for (std::size_t period = 1; period <= kLongest && period < held.size(); ++period) {
    std::vector<Illumination> entries(period);
    bool is_consistent = true;
    for (const auto& exposure : held) {
      Illumination& entry = entries[exposure->number % period];
      const Illumination own = exposure->frame.illumination;
      if (own.is_unknown() || !(entry.is_unknown() || entry == own)) is_consistent = false;
      entry = own;
    }
    const auto is_lit = [](Illumination entry) { return entry.is_lit(); };
    const auto is_unknown = [](Illumination entry) { return entry.is_unknown(); };
    const bool is_whole = std::none_of(entries.begin(), entries.end(), is_unknown) &&
                          std::any_of(entries.begin(), entries.end(), is_lit);
    if (is_consistent && is_whole) return IlluminationPattern(std::move(entries));
  }
  return {};
}

}  // namespace striper::detail
