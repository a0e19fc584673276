// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// Marks speckle: returns that no straight line through their neighbours on the left or on the
/// right predicts, and no curve. One side is enough, so the points of a corner and of an edge stay;
/// so do those of a face with few returns, one of them speckle, of the limb of a pipe or a ball,
/// and of a place where most returns are rough. About 10 ns per return that fits between its
/// neighbours and a microsecond per one that does not.
///
/// Without it a partition under Gaussian noise takes one gross outlier for an object of its own:
/// at 2 % of them a fifth of all scans of a flat road show a step that is not there.
class OutlierGate {
 public:
  /// Returns one flag per element; valid until the next call. Allocates only while scans grow.
  const std::vector<char>& mark(const InverseRanges& ranges);

 private:
  enum class Opinion { kNone, kFits, kRefuses };

  static constexpr std::size_t kNearest = 4;
  static constexpr std::size_t kOfCurve = 6;  // Four or five keep as many of a limb.
  struct Nearest {
    std::array<std::size_t, kOfCurve> at{};
    std::size_t count = 0;
  };

  void mark_suspects(const InverseRanges& ranges);
  bool is_predicted(const InverseRanges& ranges, std::size_t i) const noexcept;
  bool is_on_curve(const InverseRanges& ranges, std::size_t i) const noexcept;
  Opinion opinion_of_solid(const InverseRanges& ranges, std::size_t i, int side) const noexcept;
  Nearest nearest(std::size_t i, std::size_t before, std::size_t after) const noexcept;
  bool is_rough_around(std::size_t i) const noexcept;

  static double off_neighbours(const InverseRanges& ranges, std::size_t i) noexcept;
  static Opinion opinion_of_all(const InverseRanges& ranges, std::size_t i, const Nearest& few,
                                double gate_sigmas) noexcept;
  static Opinion opinion_of_curve(const InverseRanges& ranges, std::size_t i,
                                  const Nearest& few) noexcept;
  static Opinion opinion_of(const LineSums& neighbours, const InverseRanges& ranges, std::size_t i,
                            double gate_sigmas) noexcept;

  std::vector<char> suspect_;
  std::vector<double> suspicion_;   // Squared misfit between its neighbours.
  std::vector<std::size_t> order_;  // The most suspect first.
  std::vector<int> suspects_before_;
  std::vector<char> marked_;
};

}  // namespace striper::detail
