// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace striper::detail {

/// A return that is the stripe for sure. Pixels of the image.
struct SureReturn {
  int line;
  double position, sigma;
  double amplitude_dn;
  float log_odds;
  bool is_bridged;  ///< Measured in a gap, in a pass before.
};

/// The sure returns nearest to a scan line on both sides, or on one alone. Valid until the next
/// `begin`, `clear` or `add`. Nothing but the sizes can be asked where there are none.
struct SureBeside {
  std::span<const SureReturn> before, after;

  bool is_one_sided() const noexcept { return before.empty() || after.empty(); }
  std::size_t size() const noexcept { return before.size() + after.size(); }
  /// The nearest on either side; where that has none, on the other.
  const SureReturn& nearest_before() const noexcept {
    return before.empty() ? after.front() : before.back();
  }
  const SureReturn& nearest_after() const noexcept {
    return after.empty() ? before.back() : after.front();
  }
  int lines_to_measured(int line) const noexcept;  ///< To the nearest that was not bridged.
  int lines_spanned() const noexcept;
};

/// Where a line of sure returns crosses a scan line. Pixels of the image.
struct SureLine {
  double position = 0.0;
  double sigma = 0.0;
  /// Of the returns about the line: chi squared over its degrees of freedom of a near line, one
  /// robust sigma squared of a far one, at least 1, in their own. `sigma` has it.
  double scatter = 0.0;
  std::size_t asked = 0;  ///< Returns on the side that has fewer.
  // Of a far line:
  double part_on = 1.0;   ///< Of the returns, that lies on it,
  std::size_t bears = 0;  ///< and how many on the side with fewer do, and were not bridged.
};

/// Whether most of a far line's returns lie on it, on both sides, and it says well where it is.
bool is_trusted(const SureLine& far) noexcept;

/// Where the stripe of a scan line should be, by the sure returns about it. Pixels of the image.
struct ExpectedPlace {
  int line;
  SureBeside by;
  double position, sigma;
  SureLine near;                           ///< Of the returns beside,
  std::optional<SureLine> far;             ///< and of many on both sides.
  double amplitude_dn, most_amplitude_dn;  ///< Of the returns beside, on the mean and at most.
};

/// What of a frame is the stripe for sure, in the order of the scan lines, and the straight lines
/// through it. No allocation after the first frame of a size.
class SureReturns {
 public:
  void begin(std::size_t lines);
  void clear() noexcept { returns_.clear(); }
  /// In the order of the scan lines.
  void add(const SureReturn& sure) { returns_.push_back(sure); }

  /// Up to 12 on a side, within 150 scan lines; a side of fewer than 4 says nothing and is left
  /// out.
  SureBeside beside(int line) const;

  /// The least squares line through these; none of fewer than 8.
  static std::optional<SureLine> near_line(int line, const SureBeside& beside);

  /// The line on which most of those on both sides lie, within 80 scan lines, whatever the rest
  /// does: other surfaces. By weights after Cauchy's distribution, of up to 24 on a side. None
  /// where a side has fewer than 4.
  std::optional<SureLine> far_line(int line) const;

  /// By the far line, where it is trusted; else by the near one, where its returns lie on it. Of
  /// one side alone: of which one that was not bridged is at most 8 scan lines away.
  std::optional<ExpectedPlace> expected_at(int line, const SureBeside& beside) const;

 private:
  std::vector<SureReturn> returns_;
};

}  // namespace striper::detail
