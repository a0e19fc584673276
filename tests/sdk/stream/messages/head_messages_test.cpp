// SPDX-License-Identifier: Apache-2.0
// Proves that camera, transforms and status are said as ROS 2's messages define them: the camera's
// matrices, a region and a binning, transforms that map as the model does, the level of a status.
#include <gtest/gtest.h>

#include <striper/stream/messages/head_messages.hpp>

#include "support/models.hpp"

namespace striper {
namespace {

TEST(HeadMessages, CameraInfoIsTheModelsCamera) {
  const StriperModel model = testing::typical_model();
  wire::CameraInfo info;
  to_message(model, "left", PixelGrid::region(40, 24), info);
  EXPECT_EQ(info.header.frame_id, "left_camera_optical");
  EXPECT_EQ(info.width, 640U);
  EXPECT_EQ(info.height, 480U);
  EXPECT_EQ(info.distortion_model, "plumb_bob");
  EXPECT_EQ(info.d, model.camera.distortion());
  EXPECT_EQ(info.k, (std::array<double, 9>{615, 0, 322.5, 0, 612, 236, 0, 0, 1}));
  EXPECT_EQ(info.p, (std::array<double, 12>{615, 0, 322.5, 0, 0, 612, 236, 0, 0, 0, 1, 0}));
  EXPECT_EQ(info.roi.x_offset, 40U);
  EXPECT_EQ(info.roi.y_offset, 24U);
  EXPECT_EQ(info.binning_x, 1U);
}

TEST(HeadMessages, BinnedPixelsBeginAtTheSensorsCorner) {
  wire::CameraInfo info;
  to_message(testing::typical_model(), "left", PixelGrid::binned(2, 4), info);
  EXPECT_EQ(info.binning_x, 2U);
  EXPECT_EQ(info.binning_y, 4U);
  EXPECT_EQ(info.roi.x_offset, 0U);
  EXPECT_EQ(info.roi.y_offset, 0U);
}

TEST(HeadMessages, TransformsMapAsTheModelDoes) {
  const auto model = std::make_shared<const StriperModel>(testing::typical_model());
  const HeadInfo head = head_info("left", {}, model, StripeAxis::kColumns);
  wire::TFMessage message;
  to_message(head, message);
  ASSERT_EQ(message.transforms.size(), 2U);
  EXPECT_EQ(message.transforms[0].child_frame_id, "left_camera_optical");
  EXPECT_EQ(message.transforms[1].child_frame_id, "left_scan0");
  const Eigen::Isometry3d expected[] = {T_head_cam(), T_head_cam() * model->T_cam_scan(0)};
  const Eigen::Vector3d point(0.3, -1.2, 2.5);
  for (std::size_t i = 0; i < 2; ++i) {
    const wire::Transform& t = message.transforms[i].transform;
    EXPECT_EQ(message.transforms[i].header.frame_id, "left");
    const Eigen::Quaterniond q(t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z);
    const Eigen::Vector3d mapped =
        q * point + Eigen::Vector3d(t.translation.x, t.translation.y, t.translation.z);
    EXPECT_LT((mapped - expected[i] * point).norm(), 1e-12);
  }
}

TEST(HeadMessages, StatusHasALevel) {
  ScannerStatus status;
  status.head = "left";
  wire::DiagnosticArray message;
  to_message(status, message);
  ASSERT_EQ(message.status.size(), 1U);
  EXPECT_EQ(message.status[0].level, wire::DiagnosticStatus::kOk);
  EXPECT_EQ(message.status[0].name, "left: scanner");
  status.counts.scans = 7;
  to_message(status, message);
  EXPECT_EQ(message.status[0].level, wire::DiagnosticStatus::kWarn);
  status.ambient.phase = TrackingPhase::kLost;
  to_message(status, message);
  ASSERT_EQ(message.status.size(), 1U);
  EXPECT_EQ(message.status[0].level, wire::DiagnosticStatus::kError);
  bool has_scans = false;
  for (const wire::KeyValue& value : message.status[0].values) {
    has_scans = has_scans || (value.key == "scans" && value.value == "7");
  }
  EXPECT_TRUE(has_scans);
}

}  // namespace
}  // namespace striper
