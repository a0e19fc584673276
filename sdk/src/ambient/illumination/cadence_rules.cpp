// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/cadence_rules.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace striper::detail {

bool agree(const Cadence& a, const Cadence& b) {
  const std::uint64_t whole = a.pattern().size() * b.pattern().size();
  for (std::uint64_t n = 0; n < whole; ++n) {
    if (a.at(n).is_dark() != b.at(n).is_dark()) return false;
  }
  return true;
}

std::optional<Cadence> turned_to(const Cadence& cadence, const Cadence& found) {
  std::optional<Cadence> only;
  std::vector<Illumination> pattern = cadence.pattern();
  for (std::size_t turn = 0; turn < pattern.size(); ++turn) {
    std::rotate(pattern.begin(), pattern.begin() + 1, pattern.end());
    const Cadence turned(pattern);
    if (!agree(turned, found)) continue;
    for (std::size_t n = 0; only && n < pattern.size(); ++n) {
      if (turned.at(n) != only->at(n)) return std::nullopt;
    }
    only = turned;
  }
  return only;
}

bool has_dark_of_same_rows(const Cadence& cadence) {
  const std::uint64_t whole = 2 * cadence.pattern().size();  // An odd period meets both parities.
  for (std::uint64_t parity = 0; parity < 2; ++parity) {
    bool is_lit = false;
    bool is_dark = false;
    for (std::uint64_t n = parity; n < whole; n += 2) {
      (cadence.at(n).is_dark() ? is_dark : is_lit) = true;
    }
    if (is_lit && !is_dark) return false;
  }
  return true;
}

Cadence pattern_of_labels(const HeldExposures& held) {
  constexpr std::size_t kLongest = 8;
  for (std::size_t period = 1; period <= kLongest && period < held.size(); ++period) {
    std::vector<Illumination> pattern(period);
    bool is_consistent = true;
    for (const auto& exposure : held) {
      Illumination& entry = pattern[exposure->number % period];
      const Illumination own = exposure->frame.illumination;
      if (own.is_unknown() || !(entry.is_unknown() || entry == own)) is_consistent = false;
      entry = own;
    }
    const auto is_lit = [](Illumination entry) { return entry.is_lit(); };
    const auto is_unknown = [](Illumination entry) { return entry.is_unknown(); };
    const bool is_whole = std::none_of(pattern.begin(), pattern.end(), is_unknown) &&
                          std::any_of(pattern.begin(), pattern.end(), is_lit);
    if (is_consistent && is_whole) return Cadence(std::move(pattern));
  }
  return {};
}

}  // namespace striper::detail
