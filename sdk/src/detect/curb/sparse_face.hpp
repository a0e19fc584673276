// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/profile/segments.hpp>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// Finds the face of which so few returns are left, some of them speckle, that they make no piece:
/// of the lines through two of them that stand as faces do, the one that most returns are on.
///
/// Least truncated squares over all pairs, so that half of the returns may be speckle. About 10 us
/// for ten returns.
class SparseFace {
 public:
  /// @param from,to the elements between road and top. @param up away from the road.
  /// Returns the face's line, or nothing where fewer than `fewest` returns are on one.
  /// Allocates only while scans grow.
  std::optional<ScanLine> find(const InverseRanges& ranges, std::size_t from, std::size_t to,
                               const Eigen::Vector2d& up, std::size_t fewest);

  /// More elements than this are no sparse face.
  static constexpr std::size_t kMost = 24;

 private:
  double truncated_misfit(const InverseRanges& ranges, std::size_t from, std::size_t to,
                          const Eigen::Vector2d& line);

  std::vector<std::size_t> on_;
  std::vector<std::size_t> best_;
};

}  // namespace striper::detail
