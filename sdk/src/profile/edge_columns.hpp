// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// So many columns at most see both sides of an edge: a lens's blur of half a pixel reaches this
/// far.
inline constexpr int kMostMixed = 2;

/// How bright a surface of elements `from` to `to` is near its end, where no column sees the edge:
/// the median of a few, DN. 0 where it is not known, or the surface is too short to tell.
float brightness_inside(const InverseRanges& ranges, std::size_t from, std::size_t to,
                        bool is_end) noexcept;

/// Marks the columns that see the last of a surface with a part of their width, or through the
/// lens's blur alone: they are dimmer, and their range lies off by more than their sigma says,
/// since the light comes from one side of the column. Where the brightness is not known nothing is
/// marked.
class EdgeColumns {
 public:
  /// Returns one flag per element; valid until the next call. Allocates only while scans grow.
  const std::vector<char>& mark(const InverseRanges& ranges);

 private:
  void mark_end(const InverseRanges& ranges, std::size_t from, std::size_t to, bool is_end);

  std::vector<char> marked_;
};

}  // namespace striper::detail
