// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "profile/cutter.hpp"

namespace striper::detail {

/// How far returns of a run lie off its line beyond their noise, one sigma, metres across it; 0
/// where noise explains all of it.
double scatter_m(const InverseRanges& ranges, const Run& run) noexcept;

/// Whether a piece that scatters so was built: asphalt scatters by .5 to 1.5 mm, chippings and
/// setts by up to 4. The limit is 5 mm; grass of which only tips are seen may be below it, and is
/// told by GroundRoughness.
bool is_paved(double scatter_m) noexcept;

/// Tells built ground from grown by how the heights of its returns scatter about a line that leans
/// as ground does.
class GroundRoughness {
 public:
  /// A scatter of the heights, one sigma, and how often ground has it.
  struct Scatter {
    double sigma_m, part;
  };

  void clear() noexcept { heights_.clear(); }
  /// @param at_m outwards, and above the road. @param variance_m2 of the height, by noise.
  void add(const Eigen::Vector2d& at_m, double variance_m2) {
    heights_.push_back({at_m, variance_m2});
  }
  std::size_t size() const noexcept { return heights_.size(); }
  /// Whether there are enough to tell.
  bool can_tell() const noexcept { return heights_.size() >= kFewest; }
  /// Leaves out what lies farther out.
  void end_at(double out_m);

  /// Returns ln p(heights | overgrown) - ln p(heights | paved), each a mean over the scatters that
  /// such ground has, 3 % of the returns being of neither; 0 where there are too few to tell.
  double log_odds_of_overgrown() const noexcept;

  /// The same where there are too few to tell and a paved surface would have so many, on average:
  /// blades hide half of what is behind them, and counts are of Poisson's kind.
  static double log_odds_of_too_few(double returns) noexcept;

 private:
  static constexpr std::size_t kFewest = 4;
  struct Height {
    Eigen::Vector2d at_m;
    double variance_m2;
  };
  double log_likelihood(std::span<const Scatter> scatters) const noexcept;
  double log_likelihood(double scatter_m) const noexcept;

  std::vector<Height> heights_;
};

}  // namespace striper::detail
