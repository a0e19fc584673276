// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <striper/geometry/line_fit.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper::detail {

/// The good returns of a scan in the coordinates in which straight lines are linear and the noise
/// is Gaussian: direction and inverse distance from the pivot, with 1/q = p0 cos + p1 sin for every
/// line p0 x + p1 y = 1. Structure of arrays, one element per good return, in the scan's order.
struct InverseRanges {
  Eigen::Vector2d pivot{0.0, 0.0};
  std::vector<std::size_t> index;  // Of the return.
  std::vector<double> cosine;
  std::vector<double> sine;
  std::vector<double> q;         // 1/m.
  std::vector<double> weight;    // 1 / variance of q, by noise and texture.
  std::vector<double> noise;     // The variance of q by noise alone.
  std::vector<float> intensity;  // DN; 0 where it is not known.

  std::size_t size() const noexcept { return q.size(); }

  /// Takes the returns that are ok, with a range and a sigma. Allocates only while scans grow.
  void take(const PolarScan& scan, const Eigen::Vector2d& pivot_m);

  /// Where element i is, scan frame.
  Eigen::Vector2d at_m(std::size_t i) const noexcept {
    return pivot + Eigen::Vector2d(cosine[i], sine[i]) / q[i];
  }

  void add_to(LineSums& sums, std::size_t i) const noexcept {
    sums.add(cosine[i], sine[i], q[i], weight[i]);
  }

  /// The same about the direction of element `about`, in which short pieces lose no digits.
  void add_rotated(LineSums& sums, std::size_t i, std::size_t about) const noexcept {
    sums.add(cosine[i] * cosine[about] + sine[i] * sine[about],
             sine[i] * cosine[about] - cosine[i] * sine[about], q[i], weight[i]);
  }

  /// The squared misfit of element i to the line with these parameters, over its variance.
  double misfit(std::size_t i, const Eigen::Vector2d& parameters) const noexcept {
    const double e = q[i] - parameters.x() * cosine[i] - parameters.y() * sine[i];
    return e * e * weight[i];
  }

  /// The sine of the angle from element i to element j.
  double turn(std::size_t i, std::size_t j) const noexcept {
    return sine[j] * cosine[i] - cosine[j] * sine[i];
  }

  void reserve(std::size_t returns);
  void remove_marked(const std::vector<char>& marked);

  /// Takes columns away that see a surface with a part of their width.
  void remove_part_seen(const std::vector<char>& marked);

  /// What stands next to element i, outwards, at least so bright but not used.
  struct Beyond {
    int part_seen = 0;  ///< Columns that see this surface with a part of their width.
    int mixed = 0;      ///< And behind them doubtful ones and speckle, as edges give.
  };
  /// @param most of each are looked at.
  Beyond beyond(std::size_t i, bool is_later, float least_dn, int most) const noexcept;

 private:
  void clear() noexcept;

  // Of every return, used or not.
  std::vector<float> all_intensities_;  // 0 where nothing is there.
  std::vector<char> is_part_seen_;
};

}  // namespace striper::detail
