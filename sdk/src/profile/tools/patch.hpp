// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <striper/profile/tools.hpp>

#include "profile/inverse_ranges.hpp"
#include "profile/joints.hpp"
#include "profile/surface_edge.hpp"

namespace striper::detail {

/// What a tool measures of a scan once its regions are known: fixed, so that it can be measured
/// again with the same returns moved.
struct Patch {
  std::size_t run = 0;                // The piece that most of the region's returns are on.
  std::vector<std::size_t> elements;  // Its elements in the region, ascending; of one patch alone
                                      // also those of pieces on the same line.
  std::vector<std::size_t> surface;   // And those of the pieces that it goes on in.
  std::vector<std::size_t> all;       // And of everything else in the region.
  bool is_straight = true;            // The piece is nearly all of its surface.
};

/// A patch's line, and how its returns scatter about it.
struct PatchLine {
  LineFit fit;         // Covariance by noise and texture alone.
  double scale = 1.0;  // Of sigmas, where the scatter is more than that.
  ScanLine line;

  double variance_of_q(const Eigen::Vector2d& v) const noexcept {
    return scale * scale * fit.variance_at(v.x(), v.y());
  }
};

/// Where a patch ends.
struct PatchEnd {
  Eigen::Vector2d at_m{0.0, 0.0};  // Scan frame.
  Eigen::Vector2d direction{1.0, 0.0};
  double q = 0.0;  // 0: a corner, whose covariance has everything.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  // Besides that of the patch's line.

  /// Its whole covariance.
  Eigen::Matrix2d covariance_with(const PatchLine& line) const noexcept;
  /// How it moves by the parameters of its patch's line: zero for a corner.
  Eigen::Matrix2d by_line() const noexcept;
};

/// Whether the camera looks on beyond a scan's first and last good return.
struct SeenBeyond {
  bool first = false;
  bool last = false;
};

/// The pieces of a scan, for tools.
class Patches {
 public:
  /// @param ranges, runs  of a Cutter; must stay while this is used.
  Patches(const InverseRanges& ranges, const std::vector<Run>& runs, SeenBeyond seen);

  /// Finds the patches of a tool: one per region; of one region or none as many as it takes.
  /// Returns kOk, kFewPoints or kAmbiguous.
  MeasureStatus find(const MeasureTool& tool, std::vector<Patch>& patches) const;

  /// The end of a patch that comes later (or earlier) in the scan.
  /// @param ranges  as they are or moved.
  PatchEnd end_of(const InverseRanges& ranges, const Patch& patch, const PatchLine& line,
                  bool is_later) const;

  /// Whether that end is in the region (and not where the region cuts through the surface), and
  /// the scan goes on beyond it.
  bool is_end_seen(const Patch& patch, const MeasureRegion& region, bool is_later) const;

 private:
  struct Content {
    std::vector<std::size_t> elements;  // Of the region.
    std::vector<std::size_t> counts;    // Per run.
    std::vector<std::size_t> order;     // Runs by their counts, most first.
  };
  Content content_of(const MeasureRegion& region) const;
  bool has_rival(const Content& content, std::size_t wanted) const;
  MeasureStatus find_all_in(const MeasureRegion& region, std::vector<Patch>& patches) const;
  MeasureStatus find_in(const MeasureRegion& region, std::size_t wanted,
                        std::vector<Patch>& patches) const;
  Patch patch_of(std::size_t run, const std::vector<std::size_t>& all, bool is_alone) const;
  bool are_on_one_line(std::size_t a, std::size_t b) const;
  std::size_t surface_of(std::size_t run) const noexcept;
  std::size_t last_run_of(std::size_t run, bool is_later) const noexcept;
  std::size_t run_of(std::size_t element) const noexcept;

  const InverseRanges& ranges_;
  const std::vector<Run>& runs_;
  SeenBeyond seen_;
  std::vector<char> goes_on_;  // Per run: in the next one, at a corner or because it is curved.
};

/// The straight line through elements.
PatchLine fit_patch(const InverseRanges& ranges, std::span<const std::size_t> elements);

/// The place of an element, scan frame.
inline Eigen::Vector2d point_of(const InverseRanges& ranges, std::size_t i) noexcept {
  return ranges.pivot + Eigen::Vector2d(ranges.cosine[i], ranges.sine[i]) / ranges.q[i];
}

/// By how much chi2 of so many degrees of freedom says that sigmas are too small, as a factor; 1
/// where chance makes it one time in 1e5 or more often.
double scatter_scale(double chi2, int dof) noexcept;

}  // namespace striper::detail
