// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <striper/detect/curb_finding.hpp>

namespace striper::detail {

/// What a track may be: something that goes on along the road, something that stands on it and
/// ends, or what a scan took for one of these by chance. Log weights, by Bayes.
class CurbHypotheses {
 public:
  /// Of the finding that began it.
  /// @param overgrown the probability that what begins there is, before it is looked at.
  void start(const CurbFinding& seen, double overgrown) noexcept;
  /// It was seen again, a way later.
  void hit(const CurbFinding& seen, double way_m, double object_length_m) noexcept;
  /// It was not there, though nothing hid it.
  void miss(double way_m, double object_length_m) noexcept;
  /// Something else is found at its place, a way later: where that is overgrown, so is this.
  void see_beside(const CurbFinding& other, double way_m) noexcept;

  double probability_of(CurbKind kind) const noexcept;
  /// That it is a curb, up or down.
  double probability_of_curb() const noexcept;
  /// That there is anything.
  double probability_of_something() const noexcept;
  /// That what lies beyond the edge is, if there is anything.
  double probability_of_overgrown() const noexcept { return overgrown_; }
  /// The most probable of up, down and ramp; of anything else where that is more probable.
  CurbKind kind() const noexcept;

 private:
  struct Weights {
    double lasting, ending, chance;
  };
  Weights weights() const noexcept;
  void bound() noexcept;
  void take_kinds(const CurbFinding& seen, double share) noexcept;
  void take_growth(const CurbFinding& seen, double share) noexcept;
  double part_of(CurbKind kind) const noexcept;

  double lasting_ = 0.0;
  double ending_ = 0.0;
  double chance_ = 0.0;
  // Fading mean of what single scans say, were it not overgrown.
  std::array<double, kCurbKindCount> kinds_{};
  double hole_ = 0.0;       // Of kNone, what is there and no curb.
  double overgrown_ = 0.0;  // Probability, by all scans.
};

}  // namespace striper::detail
