// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "profile/inverse_ranges.hpp"
#include "profile/shape/curve_filter.hpp"

namespace striper::detail {

/// How a surface goes on beyond its outermost return: on that line, from which it wanders by noise
/// of that density; 0 for a straight one.
struct Continuation {
  CurveSmoother::Line line{};
  double density = 0.0;
  std::size_t outermost = 0;  // Element.

  CurveSmoother::Estimate at(const InverseRanges& ranges, std::size_t i) const noexcept;
};

/// Elements [from, to) that one surface estimates.
struct SmoothedSurface {
  std::size_t from = 0;
  std::size_t to = 0;
  Continuation before;
  Continuation beyond;
};

/// Weighs what two surfaces say of the returns beside their seam.
///
/// Which return is the first of the right one is known from these returns' own noise alone: at a
/// weak step, or where a face bends, several may be. Each is as probable as it makes the returns
/// under both surfaces (each return judged by what the others say), and a return's estimate is the
/// mean over them, its variance with how far both surfaces differ (Hoeting et al. 1999, equations 3
/// and 4). At a clear step nothing changes.
class Seam {
 public:
  /// Changes the estimates, one per element of `ranges`, beside the seam of surfaces that touch. 20
  /// ns for each return that may be on either.
  void blend(const InverseRanges& ranges, const SmoothedSurface& left, const SmoothedSurface& right,
             std::vector<CurveSmoother::Estimate>& estimates);

 private:
  struct Other {  // What the other surface says of a return,
    CurveSmoother::Estimate estimate;
    double weight;  // and how probable a seam right behind it is, over one where it was found.
  };
  static double add_side(const InverseRanges& ranges, const SmoothedSurface& own,
                         const Continuation& other, bool is_right,
                         const std::vector<CurveSmoother::Estimate>& estimates,
                         std::vector<Other>& others);
  static void mix(const SmoothedSurface& own, bool is_right, double total,
                  const std::vector<Other>& others,
                  std::vector<CurveSmoother::Estimate>& estimates);

  std::vector<Other> on_left_;
  std::vector<Other> on_right_;
};

}  // namespace striper::detail
