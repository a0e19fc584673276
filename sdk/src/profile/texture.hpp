// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// Estimates how rough the surfaces of a scan are, and weighs its returns accordingly.
///
/// Rough means an independent Gaussian displacement of every return across the surface. Estimated
/// from how far returns lie off the straight line between their neighbours, without the tails that
/// corners and edges make; 0 unless it stands out of chance. About 10 us for 640 smooth returns,
/// 60 us for rough ones.
class Texture {
 public:
  /// Returns the one-sigma texture in metres. Allocates only while scans grow.
  double estimate_m(const InverseRanges& ranges);

  /// Sets the weights to those of noise and texture. The last estimate has to be of these ranges.
  void apply(double texture_m, InverseRanges& ranges) const;

 private:
  void take_differences(const InverseRanges& ranges);
  void take_leverages(const InverseRanges& ranges);
  double excess(double texture_m2);

  // Of each element with two neighbours: the squared difference, its variance by noise, and what a
  // texture of 1 m adds to it.
  std::vector<double> squares_;
  std::vector<double> noise_;
  std::vector<double> gain_;
  std::vector<double> leverage_;  // What 1 m across the surface does to q, squared; per element.
  std::vector<double> ratios_;
};

}  // namespace striper::detail
