// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace striper {

struct PaintFinderOptions {
  std::size_t samples = 142;  ///< Of a sweep; the report's (section 2.5).
  /// What is above it is looked at as paint, in the sweep's unit; NaN: automatic, 5 times the noise
  /// above the road.
  double threshold = std::numeric_limits<double>::quiet_NaN();
  double width_samples = 16.0;   ///< Of the stripe; the report's, 4 in (appendix B).
  double width_tolerance = 0.5;  ///< A line of another width is no line, by this share of it.

  /// @throws Error{kBadValue} naming field, value and bound.
  void validate() const;
};

/// A painted line across a sweep. Positions count samples; 0 is the middle of the first one.
struct PaintLine {
  double begin = 0.0;  ///< Its edges, where the signal is halfway between road and paint.
  double end = 0.0;
  double sigma_begin = 0.0;  ///< One sigma, from the noise and the slope there.
  double sigma_end = 0.0;
  double height = 0.0;  ///< Of the paint above the road.

  double centre() const noexcept { return 0.5 * (begin + end); }
  double width() const noexcept { return end - begin; }
  double sigma() const noexcept;  ///< Of the centre.
};

/// Finds the painted lines across a sweep, by their edges.
///
/// Road and noise are the median and the median absolute deviation of the sweep: the lines must
/// cover less than half of it. What the threshold finds has its edges at its own half height, so
/// that the threshold moves them only where it sees another piece of the paint. A line that the
/// window cuts has no centre and is left out.
///
/// No allocation after construction. Not thread-safe.
/// Source: section 2.3 of Advanced Retro Technology, *Automated Paint Restriping Recognition and
/// Guidance System*, UCD-ARR-91-11-01-01, 1991, which takes the edges at the threshold itself.
class PaintFinder {
 public:
  explicit PaintFinder(const PaintFinderOptions& options);  ///< @throws Error as `validate` does.

  /// @param sweep the first `samples` of it are looked at; a short one ends early
  /// @return in the sweep's order (of a double line the left one first, where it runs from left to
  ///         right); valid until the next call. Empty where a sample is no number.
  std::span<const PaintLine> find(std::span<const double> sweep) noexcept;

  /// What of the last sweep was above the threshold and has the width of no line; valid as long.
  std::span<const PaintLine> others() const noexcept { return others_; }

 private:
  struct Road {
    double level = 0.0;
    double noise = 0.0;
  };
  Road measure_road(std::span<const double> sweep) noexcept;
  void add_line(std::span<const double> sweep, std::size_t first, std::size_t past,
                const Road& road) noexcept;
  double median_of(std::span<const double> values) noexcept;

  PaintFinderOptions options_;
  std::vector<double> sorted_;
  std::vector<PaintLine> lines_;
  std::vector<PaintLine> others_;
};

}  // namespace striper
