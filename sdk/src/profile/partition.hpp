// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// Fewest returns of a piece: two for the line, one that says whether there is one.
inline constexpr std::size_t kFewestOfPiece = 3;

/// Fewest returns whose own variance is worth estimating: it is then known to a third.
inline constexpr std::size_t kFewestOfRough = 16;

/// Cuts the elements of an InverseRanges into straight pieces so that
///
///   sum over the pieces of min(chi2, m ln(chi2 / m) + m + rough_penalty) + penalty
///
/// is least over all ways of cutting (Jackson et al. 2005, An algorithm for optimal partitioning of
/// data on an interval). The second term is a rough piece of m points, whose own variance is
/// estimated (-2 log likelihood). Exact: what is not computed is proven not to be the minimum,
/// because a piece never costs less than a part of it. So one evaluation bounds eight beginnings,
/// and what a beginning cost at an earlier end bounds it until the least cost has caught up (in the
/// spirit of PELT: Killick, Fearnhead & Eckley 2012, theorem 3.1).
///
/// About 110 us for 640 elements of one line, 220 us of waves. Not thread-safe.
class Partition {
 public:
  struct Penalties {
    double piece;
    double rough;
  };

  /// Returns the first element of each piece, ascending; empty for fewer than kFewestOfPiece
  /// elements. Valid until the next call. Allocates only while scans grow.
  const std::vector<std::size_t>& cut(const InverseRanges& ranges, const Penalties& penalties);

  /// The sums of elements [from, to) of the last call, less a common line that chi2 and covariance
  /// do not see.
  double chi2(std::size_t from, std::size_t to) const noexcept { return between(from, to).chi2(); }

 private:
  struct Block {
    std::size_t from;
    double least;  // Of the costs up to its beginnings.
    double lower;  // What its beginnings cost at least, here and at all later ends.
  };

  void prepare(const InverseRanges& ranges);
  LineSums between(std::size_t from, std::size_t to) const noexcept;
  double cost(double chi2, std::size_t points) const noexcept;
  double long_cost(std::size_t from, std::size_t to) const noexcept;
  void end_at(const InverseRanges& ranges, std::size_t to);
  void try_near(const InverseRanges& ranges, std::size_t from, std::size_t to) noexcept;
  void try_begin(std::size_t begin, std::size_t to) noexcept;
  void take(std::size_t begin, double total) noexcept;
  void try_blocks(std::size_t to) noexcept;
  void close_block(std::size_t to);
  void trace_back();

  Penalties penalties_{};
  std::vector<LineSums> before_;  // Prefix sums.
  std::vector<double> best_;      // Least cost of all elements before this one, penalties included.
  std::vector<double> lower_;     // What a beginning costs at least, here and at all later ends.
  std::vector<std::size_t> begin_;  // Where the last piece of it begins.
  std::vector<Block> blocks_;
  std::vector<std::size_t> cuts_;
  double found_ = 0.0;  // Of the end in work.
  std::size_t found_begin_ = 0;
};

}  // namespace striper::detail
