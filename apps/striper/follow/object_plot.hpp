// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <striper/detect/objects.hpp>

namespace striper::program {

/// What `objects --plot` shows: the last scan with objects from above, their closest points with
/// where they will be in a tenth of a second; and the range of all objects over time.
class ObjectPlot {
 public:
  void add(const PolarScan& scan, std::span<const ObjectTrack> tracks);

  /// As SVG. Precondition: a scan was added.
  std::string svg() const;

 private:
  std::vector<Eigen::Vector2d> returns_;  // Of the shown scan, scan frame.
  std::vector<Eigen::Vector2d> at_, soon_;
  std::string title_;
  std::vector<Eigen::Vector2d> road_, behind_, hidden_;  // Time and range.
  double start_s_ = ObjectTrack::kUnknown;
};

}  // namespace striper::program
