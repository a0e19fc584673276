// SPDX-License-Identifier: Apache-2.0
// Proves that a region, a binning and a field are one mapping, and that they compose.
#include <gtest/gtest.h>

#include <striper/core/pixel_grid.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

TEST(PixelGrid, BottomFieldStartsAtSensorRowOne) {
  const PixelGrid grid = PixelGrid::bottom_field();
  EXPECT_EQ(grid.sensor_v(0), 1.0);
  EXPECT_EQ(grid.sensor_v(10), 21.0);
  EXPECT_EQ(grid.sensor_u(10), 10.0);
}

TEST(PixelGrid, CentreOfABinIsTheMeanOfItsPixels) {
  const PixelGrid grid = PixelGrid::binned(2, 4);
  EXPECT_EQ(grid.sensor_u(0), 0.5);
  EXPECT_EQ(grid.sensor_v(1), 5.5);
}

TEST(PixelGrid, ThenIsTheCompositionOfTheMappings) {
  const PixelGrid outer = PixelGrid::region(100, 40);
  const PixelGrid inner = PixelGrid::bottom_field();
  for (int trial = 0; trial < 100; ++trial) {
    const double index = testing::uniform(-500, 500);
    EXPECT_DOUBLE_EQ(outer.then(inner).sensor_v(index), outer.sensor_v(inner.sensor_v(index)));
    EXPECT_DOUBLE_EQ(outer.then(inner).sensor_u(index), outer.sensor_u(inner.sensor_u(index)));
  }
  EXPECT_EQ(PixelGrid{}.then(inner), inner);
  EXPECT_EQ(inner.then(PixelGrid{}), inner);
}

TEST(PixelGrid, IndexInvertsSensor) {
  const PixelGrid grid = PixelGrid::binned(3, 3);
  EXPECT_DOUBLE_EQ(grid.v.index(grid.sensor_v(17.25)), 17.25);
}

}  // namespace
}  // namespace striper
