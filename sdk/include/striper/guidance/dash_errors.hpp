// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace striper {

struct DashErrorOptions {
  bool first_is_begin = true;    ///< The first place is where a dash begins; else, where one ends.
  double end_extension_m = 0.0;  ///< Each dash that was found is made longer by it at either end.
  double end_within_m = 0.1016;  ///< 4 in, as the report asks of an end,
  double length_within_m = 0.2032;  ///< and twice that of a length.
};

struct DashErrors {
  std::size_t ends = 0;  ///< Without the first one, which is the origin.
  std::size_t ends_within = 0;
  std::size_t lengths = 0;  ///< Of dashes and of the gaps between them.
  std::size_t lengths_within = 0;
};

/// Counts the ends of dashes, and the lengths between them, that were found near where they are.
///
/// @param measured_m places along the road, dashes beginning and ending in turn
/// @param found_m the same ends, as they were found
/// @throws Error kBadValue where the two are not of one length
/// Thread-safe; does not allocate.
/// Source: Table 1 and section 3.2 of Advanced Retro Technology, *Automated Paint Restriping
/// Recognition and Guidance System*, UCD-ARR-91-11-01-01, 1991.
DashErrors dash_errors(std::span<const double> measured_m, std::span<const double> found_m,
                       const DashErrorOptions& options = {});

}  // namespace striper
