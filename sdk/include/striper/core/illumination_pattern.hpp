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
class IlluminationPattern {
 public:
  IlluminationPattern() = default;  ///< Automatic.

  /// @throws Error{kUsage} on an empty pattern or one without a lit exposure.
  explicit IlluminationPattern(std::vector<Illumination> entries);

  /// Reads the text form. @throws Error{kUsage} quoting the entry that is neither a laser index nor
  /// `dark`.
  static IlluminationPattern parse(std::string_view text);

  bool is_automatic() const noexcept { return entries_.empty(); }
  const std::vector<Illumination>& entries() const noexcept { return entries_; }

  /// What exposure number `n` (see Frame::exposure_number) is lit by; unknown when automatic.
  Illumination at(std::uint64_t exposure_number) const noexcept;

  bool has_dark() const noexcept;

  /// The text form, which `parse` reads back.
  std::string to_string() const;

  friend bool operator==(const IlluminationPattern&, const IlluminationPattern&) = default;

 private:
  std::vector<Illumination> entries_;
};

}  // namespace striper
