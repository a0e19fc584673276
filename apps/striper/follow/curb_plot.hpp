// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <striper/detect/curb_detector.hpp>

namespace striper::program {

/// What `curb --plot` shows: the scan whose curb is plainest across the road, with road, face and
/// top; where curbs are along the way, and how high.
class CurbPlot {
 public:
  /// @param view what the scan showed by itself. @param way_m of the vehicle since the first scan.
  void add(const PolarScan& scan, const CurbView& view, std::span<const CurbTrack> tracks,
           double way_m);

  /// As SVG. Precondition: a scan was added.
  std::string svg() const;

 private:
  struct Place {
    double way_m, lateral_m, sigma_lateral_m, height_m, sigma_height_m;
    bool is_seen, is_sure;
  };

  std::vector<Eigen::Vector2d> returns_;            // Of the shown scan: lateral, height.
  std::vector<Eigen::Vector2d> road_, face_, top_;  // Pairs: from, to.
  std::string title_;
  double best_ = -1.0;
  std::vector<Place> places_;
};

}  // namespace striper::program
