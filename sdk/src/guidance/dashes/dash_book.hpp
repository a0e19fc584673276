// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <striper/guidance/paint_gun.hpp>

#include "guidance/dashes/dash_pattern.hpp"
#include "guidance/dashes/paint_ends.hpp"

namespace striper::detail {

/// An end of a dash as one or more beams have seen it.
struct DashEnd {
  double at_m = 0.0;  ///< Their mean.
  int beams = 0;
};

/// The dashes of one line, from what the forward beams see of it, and the guns that paint it.
///
/// The first beam makes a dash; what the others see of its ends is averaged with that, each end by
/// itself, and a dash that the first has missed is added. Guns hear of it at once.
class DashBook {
 public:
  /// @param beams forward ones, the farthest first. @param guns of this line; they must live on.
  DashBook(std::size_t beams, const PaintEndsOptions& ends, const GuidanceLine& line,
           std::vector<PaintGun*> guns);

  /// One look of one beam. @param is_known false where the line's place could not be seen.
  PaintLook look(std::size_t beam, bool is_paint, double at_m);

  /// The guns have forgotten all dashes: one that goes on is told to them anew, from the next look
  /// on.
  void forget() noexcept { is_forgotten_ = true; }

  const DashPattern& pattern() const noexcept { return pattern_; }
  DashPattern& pattern() noexcept { return pattern_; }

  /// A dash behind which the guns are: its ends are final. In order, each once.
  struct Dash {
    DashEnd from;
    DashEnd to;
    bool is_ended = false;
    bool is_allowed = true;  // By the pattern.
  };
  std::optional<Dash> take_before(double at_m);

  std::size_t unpainted() const noexcept { return unpainted_; }  ///< That fit no locked pattern.

 private:
  void begin(std::size_t beam, double at_m);
  void reach(double at_m);
  void end(std::size_t beam, double at_m);
  Dash* find_begin(double at_m) noexcept;
  Dash* find_end(double at_m) noexcept;
  Dash* holder(double at_m) noexcept;

  std::vector<PaintEnds> ends_;  // Of each beam.
  DashPattern pattern_;
  std::vector<PaintGun*> guns_;
  std::vector<Dash> dashes_;     // In the order of the road.
  std::vector<double> begun_m_;  // Of each beam: where its paint began; NaN on bare road.
  std::size_t unpainted_ = 0;
  bool is_forgotten_ = false;
};

}  // namespace striper::detail
