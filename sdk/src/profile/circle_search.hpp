// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "profile/joints.hpp"

namespace striper::detail {

/// Finds runs of straight pieces that are one circle.
///
/// From each run on it joins as many as gain most by it: a circle costs chi2, what a piece costs,
/// and what its third parameter has to gain. Then it moves the cuts beside circles to where both
/// pieces fit best: straight pieces have shared out the circle's ends among their neighbours. A
/// circle of fewer than kFewestOfCircle returns is not looked for. About 30 us for 640 returns on
/// one line, .3 ms with a pipe.
class CircleSearch {
 public:
  static constexpr std::size_t kFewestOfCircle = 8;

  struct Penalties {
    double piece;
    double bend;  // Of the third parameter.
    double rough;
  };

  /// Allocates only while scans grow.
  void join(const InverseRanges& ranges, const Penalties& penalties, std::vector<Run>& runs);

 private:
  struct Cut {
    std::size_t at;
    double cost;  // Of the elements in question.
  };

  CircleFit fit(const InverseRanges& ranges, std::size_t from, std::size_t to,
                const CircleFit& start) const noexcept;
  std::size_t join_from(std::size_t first, const InverseRanges& ranges, const Penalties& penalties,
                        const std::vector<Run>& runs);
  static Cut best_cut(const InverseRanges& ranges, const Run& left, const Run& right,
                      std::size_t first, std::size_t last);
  void cut_at(const InverseRanges& ranges, std::size_t cut, Run& left, Run& right) const;
  void share_out(const InverseRanges& ranges, const Penalties& penalties, std::vector<Run>& runs);
  bool settle(const InverseRanges& ranges, Run& left, Run& right);

  std::vector<std::size_t> elements_;  // 0, 1, 2, ...
  std::vector<Run> joined_;
};

/// What a piece's third parameter has to gain in chi2, so that a straight piece is bent in
/// `false_rate` of all cases: the tail of chi2 of one degree of freedom.
double bend_penalty(double false_rate) noexcept;

}  // namespace striper::detail
