// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <striper/core/illumination.hpp>

namespace striper {

/// In which order the lasers fire: one entry per exposure (frame or field) in time order, repeated.
///
/// Written `0` (laser 0 always on), `0,dark`, `0,1,2,dark`; `auto` leaves it to be found from the
/// frames.
///
/// An exposure bracket is an illumination pattern that says of each entry how long it is exposed,
/// in microseconds: `0@20,dark@20,0@200,dark@200`. What one laser lights within a round of the
/// pattern is then one scan (see Scanner).
class IlluminationPattern {
 public:
  IlluminationPattern() = default;  ///< Automatic.

  /// @throws Error{kUsage} on an empty pattern or one without a lit exposure.
  explicit IlluminationPattern(std::vector<Illumination> entries);
  /// @param exposures_us as many as there are entries, or none.
  /// @throws Error{kUsage} also where an exposure is not more than 0 or one is missing.
  IlluminationPattern(std::vector<Illumination> entries, std::vector<double> exposures_us);

  /// Reads the text form. @throws Error{kUsage} quoting the entry that is neither a laser index nor
  /// `dark`, or has an exposure that is no number of microseconds.
  static IlluminationPattern parse(std::string_view text);

  bool is_automatic() const noexcept { return entries_.empty(); }
  const std::vector<Illumination>& entries() const noexcept { return entries_; }

  /// What exposure number `n` (see Frame::exposure_number) is lit by; unknown when automatic.
  Illumination at(std::uint64_t exposure_number) const noexcept;

  bool has_dark() const noexcept;

  /// Whether it says how long each entry is exposed.
  bool is_bracket() const noexcept { return !exposures_us_.empty(); }
  /// How long exposure number `n` is, microseconds; 0 where the pattern does not say.
  double exposure_us_at(std::uint64_t exposure_number) const noexcept;

  /// The text form, which `parse` reads back.
  std::string to_string() const;

  friend bool operator==(const IlluminationPattern&, const IlluminationPattern&) = default;

 private:
  std::vector<Illumination> entries_;
  std::vector<double> exposures_us_;  // As many, or none.
};

}  // namespace striper
