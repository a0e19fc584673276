// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/profile/segments.hpp>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// Finds the face of which a few returns are left, some of them speckle: of the lines through two
/// of them that stand as faces do, the one that the returns fit best.
///
/// Least truncated squares over all pairs (Rousseeuw and Leroy 1987), so that half of the returns
/// may be speckle.
class SparseFace {
 public:
  SparseFace() {
    otherwise_.reserve(kMost);
    on_.reserve(kMost);
    best_.reserve(kMost);
  }

  /// The surfaces beside it, and its own line so far; `face` is null where there is none.
  struct Known {
    const ScanLine* road;
    const ScanLine* top;
    const ScanLine* face;
  };

  /// @param from,to the elements between road and top.
  /// Returns the face's line, or nothing where fewer than three returns are on one, or not half of
  /// those that are neither on road nor top, or where the line so far is no worse. Does not
  /// allocate.
  std::optional<ScanLine> find(const InverseRanges& ranges, std::size_t from, std::size_t to,
                               const Known& known);

  /// More elements are no sparse face: twice as many as a curb of 5 cm has at 3 m.
  static constexpr std::size_t kMost = 24;

 private:
  void judge_otherwise(const InverseRanges& ranges, std::size_t from, std::size_t to,
                       const Known& known);
  double misfit_of_all(const InverseRanges& ranges, std::size_t from,
                       const Eigen::Vector2d& parameters);

  std::vector<double> otherwise_;  // What each misses by if it is not on the face.
  std::vector<std::size_t> on_;
  std::vector<std::size_t> best_;
};

}  // namespace striper::detail
