// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <striper/guidance/guidance_config.hpp>
#include <striper/guidance/paint_finder.hpp>

namespace striper::detail {

/// Something lighter than the road across one sweep.
struct SeenPaint {
  double left_m = 0.0;  ///< Its edges across the road.
  double right_m = 0.0;
  double sigma_m = 0.0;  ///< Of its middle.
  double height = 0.0;   ///< Above the road, in the sweep's unit.
  double delay_s = 0.0;  ///< When its middle was met, after the sweep's first sample.
  bool is_line = false;  ///< By its width.

  double lateral_m() const noexcept { return 0.5 * (left_m + right_m); }
  double width_m() const noexcept { return left_m - right_m; }
};

/// What is wrong with a sweep.
struct SweepFlaw {
  bool is_constant = false;  ///< All samples are the same, or one is no number: nothing is
                             ///< measured.
  bool is_clipped = false;   ///< More than half of them are at the converter's end.
};

/// Turns a beam's sweeps into paint on the road: gain over the window taken out, lines and other
/// things found, samples turned into metres and their own times.
///
/// The gain is that of the file, or learnt: the road beside the stripe is alike everywhere, so what
/// its samples are on average is the window's gain (range, cosine, optics: a parabola over it),
/// what the converter shows without light being taken to be nothing. No allocation after
/// construction.
class BeamReader {
 public:
  BeamReader(const GuidanceBeam& beam, double stripe_width_m);

  /// In the sweep's order, from left to right; valid until the next call.
  std::span<const SeenPaint> read(std::span<const double> samples);

  SweepFlaw flaw() const noexcept { return flaw_; }

 private:
  void examine(std::span<const double> samples) noexcept;
  void learn(std::span<const double> samples) noexcept;
  void take_gain() noexcept;
  void add(const PaintLine& line, bool is_line);

  GuidanceBeam beam_;
  PaintFinder finder_;
  SweepFlaw flaw_;
  std::vector<double> gain_;   // Of each sample.
  std::vector<double> level_;  // Mean of bare road,
  std::vector<long> times_;    // and of how many sweeps.
  std::vector<char> is_bare_;
  long learnt_ = 0;
  std::vector<double> even_;  // The sweep without gain.
  std::vector<SeenPaint> seen_;
};

}  // namespace striper::detail
