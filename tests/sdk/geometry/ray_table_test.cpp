// SPDX-License-Identifier: Apache-2.0
// Proves that the table's rays and slopes are the lens', for every lens, axis and grid, and that
// where the lens has no ray the table has none.
#include "geometry/ray_table.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "support/models.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using detail::RayTable;

struct Case {
  const char* name;
  CameraModel camera;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class RayTableTest : public ::testing::TestWithParam<Case> {};

void expect_table_is_the_lens(const CameraModel& camera, StripeAxis axis, const AxisGrid& along,
                              int lines) {
  const RayTable table(camera, axis, along, lines);
  const double extent = axis == StripeAxis::kColumns ? camera.height() : camera.width();
  for (int trial = 0; trial < 2000; ++trial) {
    const int line = static_cast<int>(testing::uniform(0, lines));
    const double across = testing::uniform(-0.5, extent - 0.5);
    const double along_px = along.sensor(line);
    const auto pixel = [&](double shift) {
      return axis == StripeAxis::kColumns ? Eigen::Vector2d(along_px, across + shift)
                                          : Eigen::Vector2d(across + shift, along_px);
    };
    const RayTable::Segment segment = table.at(line, across);
    const Unprojection exact = camera.unproject(pixel(0.0));
    if (!segment.exists()) continue;
    ASSERT_EQ(exact.status, CameraStatus::kOk);
    const Projection back = camera.project(segment.xy().homogeneous());
    EXPECT_LT((back.pixel - pixel(0.0)).norm(), 2.0 * RayTable::kTolerancePx);
    const Eigen::Vector2d slope =
        (camera.unproject(pixel(0.01)).xy - camera.unproject(pixel(-0.01)).xy) / 0.02;
    EXPECT_LT((segment.dxy_dacross() - slope).norm(), 1e-4 * slope.norm());
    for (const double shift : {-0.5, 0.5}) {
      const Unprojection shifted = camera.unproject(pixel(shift));
      if (shifted.status != CameraStatus::kOk) continue;
      const Projection there = camera.project(segment.xy(shift).homogeneous());
      EXPECT_LT((there.pixel - pixel(shift)).norm(), 4.0 * RayTable::kTolerancePx);
    }
  }
}

TEST_P(RayTableTest, IsTheLensAlongBothAxes) {
  expect_table_is_the_lens(GetParam().camera, StripeAxis::kColumns, {}, 640);
  expect_table_is_the_lens(GetParam().camera, StripeAxis::kRows, {}, 480);
}

TEST_P(RayTableTest, IsTheLensOnABinnedRegion) {
  expect_table_is_the_lens(GetParam().camera, StripeAxis::kColumns, {100.5, 2.0}, 200);
}

INSTANTIATE_TEST_SUITE_P(Lenses, RayTableTest,
                         ::testing::Values(Case{"pinhole", testing::paper_model().camera},
                                           Case{"plumb_bob", testing::typical_model().camera},
                                           Case{"equidistant", testing::wide_model().camera}),
                         [](const auto& instance) { return instance.param.name; });

TEST(RayTable, FarOutsideTheSensorAndForNanThereIsNoRay) {
  const RayTable table(testing::typical_model().camera, StripeAxis::kColumns, {}, 640);
  EXPECT_FALSE(table.at(3, -2.0).exists());
  EXPECT_FALSE(table.at(3, 1e9).exists());
  EXPECT_FALSE(table.at(3, std::nan("")).exists());
  EXPECT_TRUE(table.at(3, -0.5).exists());
  EXPECT_TRUE(table.at(639, 479.5).exists());
}

}  // namespace
}  // namespace striper
