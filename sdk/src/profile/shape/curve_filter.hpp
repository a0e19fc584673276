// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// A curved surface as a Gaussian process: q'' + q = white noise, of which no noise is a straight
/// line. The state is the line that the surface follows here, as in LineFit: it wanders, so that a
/// Kalman step needs no transition. The first two returns begin it without a prior.
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

  /// Takes the elements before `to`, from where the last call ended. 20 ns each.
  void extend(std::size_t to);

  /// The strength of least -2 log likelihood of what was taken, and that, in units in which a
  /// straight line has its chi2.
  struct Best {
    double strength;
    double cost;
  };
  Best best() const;

 private:
  using Lanes = std::array<double, kStrengths>;
  void step(std::size_t i);
  void take_logarithms();

  const InverseRanges* ranges_ = nullptr;
  std::size_t next_ = 0;
  std::size_t steps_ = 0;  // Since the last logarithms.
  Lanes density_{};        // Of the white noise.
  Lanes p0_{}, p1_{}, p00_{}, p01_{}, p11_{}, misfit_{}, product_{}, logarithm_{};
  LineSums information_;            // Of what was taken, on a straight line.
  double first_information_ = 0.0;  // Its determinant at the first two returns.
};

/// The best estimate of q and its variance at every element of a surface of one strength.
class CurveSmoother {
 public:
  struct Estimate {
    double q;
    double variance;
  };
  struct Line {  // As it is known at one place.
    double p0, p1, p00, p01, p11;
  };

  /// Elements [from, to); at least three. Valid until the next call; allocates only while scans
  /// grow. About 20 ns each.
  const std::vector<Estimate>& smooth(const InverseRanges& ranges, std::size_t from, std::size_t to,
                                      double strength);

  /// What the last call returned.
  const std::vector<Estimate>& estimates() const noexcept { return estimates_; }

  /// By how much chi2 would fall if the surface broke before an element, place and slope free: chi2
  /// of two degrees of freedom where it does not (de Jong & Penzer 1998, equation 11).
  const std::vector<double>& breaks() const noexcept { return breaks_; }

  /// The surface at its first and last element, by all elements of the last call, and the density
  /// of the noise by which it wanders from there.
  const Line& at_begin() const noexcept { return begin_; }
  const Line& at_end() const noexcept { return end_; }
  double density() const noexcept { return density_; }

 private:
  struct Step {  // What an element says that those before it do not.
    double gain0, gain1, information, surprise;  // Surprise: of its q, times the information.
  };
  Line filter(const InverseRanges& ranges, std::size_t from, std::size_t to);
  void take_begin(const Line& first, const std::array<double, 5>& later) noexcept;

  Line begin_{};
  Line end_{};
  double density_ = 0.0;
  std::vector<Step> steps_;
  std::vector<Estimate> estimates_;
  std::vector<double> breaks_;
};

}  // namespace striper::detail
