// SPDX-License-Identifier: Apache-2.0
// Proves that a frame's light is exactly one of unknown, dark and a laser, unknown unless said.
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/illumination.hpp>

namespace striper {
namespace {

static_assert(Illumination() == Illumination::unknown());
static_assert(Illumination::laser(0) != Illumination::dark());

TEST(Illumination, IsOneOfThree) {
  std::vector<Illumination> all{Illumination::unknown(), Illumination::dark()};
  for (int laser = 0; laser < 64; ++laser) all.push_back(Illumination::laser(laser));
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].is_unknown() + all[i].is_dark() + all[i].is_lit(), 1) << i;
    EXPECT_EQ(all[i].is_lit(), i >= 2) << i;
    if (all[i].is_lit()) {
      EXPECT_EQ(all[i].laser_index(), static_cast<int>(i) - 2);
    }
    for (std::size_t j = 0; j < all.size(); ++j) EXPECT_EQ(all[i] == all[j], i == j);
  }
}

}  // namespace
}  // namespace striper
