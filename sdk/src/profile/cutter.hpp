// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <striper/profile/segments.hpp>

#include "profile/circle_search.hpp"
#include "profile/edge_columns.hpp"
#include "profile/inverse_ranges.hpp"
#include "profile/joints.hpp"
#include "profile/outlier_gate.hpp"
#include "profile/partition.hpp"
#include "profile/texture.hpp"

namespace striper::detail {

/// How a Segmenter works, for what builds on its pieces: the steps of `cut` in order, with what
/// they leave behind.
class Cutter {
 public:
  /// Allocates only while scans grow.
  void cut(const PolarScan& scan, const SegmentOptions& options, Segmentation& out);

  InverseRanges ranges;   // Without speckle, the texture in the weights.
  std::vector<Run> runs;  // One per piece.

  /// The ranges with what was taken for speckle, for whoever knows better; it stays among the
  /// outliers. Speckle is weighed by the texture that was seen with it, all else as in `ranges`.
  const InverseRanges& with_speckle() const noexcept {
    return has_speckle_ ? with_speckle_ : ranges;
  }

 private:
  void leave_out_part_seen(Segmentation& out);
  void leave_out_speckle(Segmentation& out);
  void weigh_with_speckle();
  void note_outliers(const std::vector<char>& marked, Segmentation& out) const;
  void take_runs(const std::vector<std::size_t>& cuts);
  void join_blurred_corners();
  static void judge_roughness(Run& run, double penalty);
  void report_pieces(const PolarScan& scan, Segmentation& out) const;
  void report_joints(Segmentation& out) const;

  InverseRanges with_speckle_;  // Where there is speckle.
  bool has_speckle_ = false;
  EdgeColumns edges_;
  OutlierGate gate_;
  Texture texture_;
  Partition partition_;
  CircleSearch circles_;
  CornerSearch corners_;
};

}  // namespace striper::detail
