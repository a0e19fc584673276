// SPDX-License-Identifier: Apache-2.0
// Proves that the counts are those of the report's Table 1, as it prints them and with its 2 in
// correction, and that ends and lengths are told apart. Does not prove how dashes are found.
#include <array>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/guidance/dash_errors.hpp>

namespace striper {
namespace {

constexpr double kFoot = 0.3048;
constexpr double kInch = 0.0254;

// Table 1, feet: by steel tape, and by the scanner. The first place is the end of a dash.
constexpr std::array kMeasured_ft = {0.0,    12.67,  21.83,  36.67,  46.0,   60.5,   69.83,  84.25,
                                     93.67,  108.08, 117.5,  132.5,  141.92, 156.33, 165.75, 180.08,
                                     189.58, 203.83, 213.33, 227.67, 237.08, 251.5,  260.92, 275.25,
                                     284.75, 299.08, 308.5,  324.58, 334.0,  348.33, 357.75, 372.17,
                                     381.58, 395.92, 405.33, 419.75, 429.17};
constexpr std::array kLaser_ft = {0.0,    12.54,  21.49,  36.67,  45.97,  60.98,  69.68,  84.61,
                                  93.56,  108.14, 117.27, 128.96, 141.75, 156.42, 165.54, 180.56,
                                  189.43, 204.43, 213.48, 227.98, 237.1,  251.17, 260.81, 275.65,
                                  284.52, 299.36, 308.91, 324.44, 333.65, 348.66, 357.53, 372.45,
                                  381.15, 396.07, 404.77, 419.87, 428.83};

DashErrors of_table_1(double end_extension_m) {
  std::vector<double> measured_m;
  std::vector<double> laser_m;
  for (const double at_ft : kMeasured_ft) measured_m.push_back(at_ft * kFoot);
  for (const double at_ft : kLaser_ft) laser_m.push_back(at_ft * kFoot);
  DashErrorOptions options;
  options.first_is_begin = false;
  options.end_extension_m = end_extension_m;
  return dash_errors(measured_m, laser_m, options);
}

// Two of the 36 lengths are next to a cross painted on the road. The report leaves them out and
// says "of 34"; they are far beyond 8 in, so that what is within is the same.
TEST(DashErrors, OfTable1AreAsPrinted) {
  const DashErrors errors = of_table_1(0.0);
  EXPECT_EQ(errors.ends, 36U);
  EXPECT_EQ(errors.ends_within, 24U);
  EXPECT_EQ(errors.lengths, 36U);
  EXPECT_EQ(errors.lengths_within, 28U);
}

TEST(DashErrors, OfTable1Corrected) {
  const DashErrors errors = of_table_1(2 * kInch);
  EXPECT_EQ(errors.ends_within, 31U);  // Printed: 32, which its own rows do not give.
  EXPECT_EQ(errors.lengths_within, 32U);
}

TEST(DashErrors, TellEndsFromLengths) {
  const std::array measured_m = {0.0, 3.0, 12.0, 15.0};
  const std::array drifting_m = {0.0, 3.09, 12.18, 15.27};  // Each length is 9 cm off.
  const DashErrors errors = dash_errors(measured_m, drifting_m);
  EXPECT_EQ(errors.ends, 3U);
  EXPECT_EQ(errors.ends_within, 1U);
  EXPECT_EQ(errors.lengths_within, 3U);
}

TEST(DashErrors, ExtendDashesAtBothEnds) {
  const std::array measured_m = {1.0, 4.0, 13.0, 16.0};
  const std::array found_m = {1.15, 3.85, 13.15, 15.85};
  EXPECT_EQ(dash_errors(measured_m, found_m).ends_within, 0U);
  DashErrorOptions options;
  options.end_extension_m = 0.15;
  EXPECT_EQ(dash_errors(measured_m, found_m, options).ends_within, 3U);
  EXPECT_EQ(dash_errors(measured_m, found_m, options).lengths_within, 3U);
}

TEST(DashErrors, AreNoneOfNothing) { EXPECT_EQ(dash_errors({}, {}).ends, 0U); }

TEST(DashErrors, RefuseEndsThatWereNotFound) {
  EXPECT_THROW(dash_errors(std::array{1.0, 2.0}, std::array{1.0}), Error);
}

}  // namespace
}  // namespace striper
