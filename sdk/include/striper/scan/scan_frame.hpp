// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <Eigen/Geometry>

#include <striper/model/striper_model.hpp>

namespace striper {

/// What a head is called where nobody says otherwise.
inline constexpr std::string_view kDefaultHead = "striper";

/// The frame that a laser's scans are in: whose it is and how it lies in its head.
///
/// The head's frame is the camera's centre with body axes: x = z_cam, y = -x_cam, z = -y_cam.
/// Immutable once made, so that every scan of a laser shares one: thread-safe.
struct ScanFrame {
  std::string head{kDefaultHead};  ///< Which striper.
  std::string frame_id;            ///< `HEAD_scanK`, K being the laser.
  int laser = 0;
  Eigen::Isometry3d T_head_scan = Eigen::Isometry3d::Identity();  ///< p_head = T * p_scan.
  /// What the ranges were computed with; null where there are none, or where nobody knows.
  std::shared_ptr<const StriperModel> model;
};

/// The rotation from a camera's axes (x right, y down, z forward) to its head's (x forward, y left,
/// z up); both have the camera's centre as origin.
Eigen::Isometry3d T_head_cam();

/// The frame of a laser's scans. @param model may be null, as may a laser that it lacks: then the
/// transform is the identity. @throws Error{kBadValue} where the laser's plane has no scan frame.
std::shared_ptr<const ScanFrame> make_scan_frame(std::string_view head, int laser,
                                                 std::shared_ptr<const StriperModel> model);

}  // namespace striper
