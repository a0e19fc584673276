// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// A curved surface as a Gaussian process: q'' + q = white noise, of which no noise is a straight
/// line. State (q, q'), one Kalman step per return; the first two returns begin it without a prior.
///
/// The noise is given as a strength: its spectral density over that of the returns' own noise,
/// times spacing^4; the kernel of the smoother is then strength^(-1/4) returns wide.
class CurveFilter {
 public:
  static constexpr std::size_t kStrengths = 4;
  /// From a bend over 30 returns to one over each single one; between them a parabola decides.
  static constexpr std::array<double, kStrengths> kStrength{1e-6, 1e-4, 1e-2, 1.0};

  /// Begins at element `from`; `ranges` must stay as it is until the last `extend`.
  void begin(const InverseRanges& ranges, std::size_t from);

  /// Takes the elements before `to`, from where the last call ended. 40 ns each.
  void extend(std::size_t to);

  /// -2 log likelihood of what was taken for each strength, less that of a straight line.
  std::array<double, kStrengths> beyond_line(const LineFit& line) const;

  /// The strength of least -2 log likelihood, and that.
  struct Best {
    double strength;
    double beyond_line;
  };
  Best best(const LineFit& line) const;

 private:
  using Lanes = std::array<double, kStrengths>;
  void step(double sine, double cosine, double q, double weight);

  const InverseRanges* ranges_ = nullptr;
  std::size_t from_ = 0;
  std::size_t next_ = 0;
  double density_ = 0.0;  // Of strength 1.
  Lanes q_{}, slope_{}, qq_{}, qs_{}, ss_{}, misfit_{}, product_{}, logarithm_{};
  double first_information_ = 0.0;  // Determinant of that of the first two returns.
};

/// The best estimate of q and its variance at every element of a surface of one strength.
class CurveSmoother {
 public:
  struct Estimate {
    double q;
    double variance;
  };

  /// Elements [from, to); at least three. Valid until the next call; allocates only while scans
  /// grow. About 30 ns each.
  const std::vector<Estimate>& smooth(const InverseRanges& ranges, std::size_t from, std::size_t to,
                                      double strength);

 private:
  struct State {
    double q, slope, qq, qs, ss;
  };
  void filter(const InverseRanges& ranges, std::size_t from, std::size_t to, double density);

  std::vector<State> filtered_;
  std::vector<State> predicted_;
  std::vector<Estimate> estimates_;
};

/// The spectral density of strength 1: of the mean weight and spacing of elements [from, to).
double unit_density(const InverseRanges& ranges, std::size_t from, std::size_t to) noexcept;

/// The information that elements [from, to) have on a straight line: its determinant.
double line_information(const InverseRanges& ranges, std::size_t from, std::size_t to) noexcept;

}  // namespace striper::detail
