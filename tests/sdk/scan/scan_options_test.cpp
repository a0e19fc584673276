// SPDX-License-Identifier: Apache-2.0
// Proves which limits of range are limits. What becomes of returns outside them is proved with
// ScanProjector.
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include <striper/scan/scan_options.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(ScanOptions, AcceptARangeThatIsNotEmpty) {
  EXPECT_NO_THROW(ScanOptions().validate()) << "everything, by default";
  for (const auto& [min_m, max_m] : {std::pair(0.0, 1e-3), std::pair(5.0, kInfinity)}) {
    EXPECT_NO_THROW((ScanOptions{min_m, max_m}).validate());
  }
}

TEST(ScanOptions, RefuseOneThatIsEmptyBehindTheScannerOrUnknown) {
  for (const auto& [min_m, max_m] :
       {std::pair(2.0, 2.0), std::pair(3.0, 2.0), std::pair(-1.0, 2.0), std::pair(kNan, 2.0),
        std::pair(0.0, kNan), std::pair(kInfinity, kInfinity)}) {
    const ScanOptions options{min_m, max_m};
    EXPECT_EQ(testing::error_of([&] { options.validate(); }).kind(), ErrorKind::kBadValue)
        << min_m << " to " << max_m;
  }
  EXPECT_STREQ(testing::error_of([] {
                 (ScanOptions{3.0, 2.0}).validate();
               }).what(),
               "min_range_m is 3 and max_range_m is 2; expected 0 <= min < max");
}

}  // namespace
}  // namespace striper
