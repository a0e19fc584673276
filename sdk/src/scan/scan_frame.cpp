// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <fmt/format.h>

#include <striper/scan/scan_frame.hpp>

namespace striper {

Eigen::Isometry3d T_head_cam() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << 0, 0, 1,  //
      -1, 0, 0,           //
      0, -1, 0;
  return T;
}

std::shared_ptr<const ScanFrame> make_scan_frame(std::string_view head, int laser,
                                                 std::shared_ptr<const StriperModel> model) {
  auto frame = std::make_shared<ScanFrame>();
  frame->head = head;
  frame->frame_id = fmt::format("{}_scan{}", head, laser);
  frame->laser = laser;
  const bool has_plane =
      model && laser >= 0 && static_cast<std::size_t>(laser) < model->lasers.size();
  if (has_plane) frame->T_head_scan = T_head_cam() * model->T_cam_scan(laser);
  frame->model = std::move(model);
  return frame;
}

}  // namespace striper
