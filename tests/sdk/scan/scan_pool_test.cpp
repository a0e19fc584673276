// SPDX-License-Identifier: Apache-2.0
// Proves that scans come back to their pool from any thread with their memory, outlive it, and that
// a pool allocates nothing once warm.
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <striper/scan/scan_pool.hpp>
#include <striper/scan/scan_span.hpp>

#include "support/allocation_counter.hpp"

namespace striper {
namespace {

TEST(ScanPool, GivesAgainWhatNobodyHolds) {
  ScanPool pool;
  const PolarScan* const first = pool.take().get();
  EXPECT_EQ(pool.take().get(), first);
  EXPECT_EQ(pool.size(), 1U);
}

TEST(ScanPool, NeverGivesWhatIsHeld) {
  ScanPool pool;
  const std::shared_ptr<const PolarScan> held = pool.take();
  EXPECT_NE(pool.take(), held);
  EXPECT_EQ(pool.size(), 2U);
}

TEST(ScanPool, ForgetsWhoseScanItWas) {
  ScanPool pool;
  pool.take()->frame = std::make_shared<ScanFrame>();
  EXPECT_EQ(pool.take()->frame, nullptr);
}

TEST(ScanPool, ScansOutliveIt) {
  std::shared_ptr<PolarScan> scan;
  {
    ScanPool pool;
    scan = pool.take();
    scan->returns.resize(3);
  }
  EXPECT_EQ(scan->returns.size(), 3U);
}

TEST(ScanPool, AllocatesNothingOnceWarm) {
  ScanPool pool;
  std::vector<std::shared_ptr<const PolarScan>> held;
  held.reserve(4);
  const auto use = [&] {
    for (int i = 0; i < 4; ++i) {
      const std::shared_ptr<PolarScan> scan = pool.take();
      scan->returns.resize(640);
      held.push_back(scan);
    }
    held.clear();
  };
  use();
  const testing::AllocationCounter counter;
  for (int i = 0; i < 10; ++i) use();
  EXPECT_EQ(counter.count(), 0U);
}

// Under the thread sanitizer: a scan that another thread read is safe to write to again.
TEST(ScanPool, ScansComeBackFromOtherThreads) {
  ScanPool pool;
  double sum = 0.0;
  for (int i = 0; i < 100; ++i) {
    std::shared_ptr<PolarScan> scan = pool.take();
    scan->returns.assign(10, Return{});
    scan->returns[3].range_m = i;
    std::thread([&sum, kept = std::shared_ptr<const PolarScan>(std::move(scan))] {
      sum += kept->returns[3].range_m;
    }).join();
  }
  EXPECT_EQ(sum, 4950.0);
  EXPECT_EQ(pool.size(), 1U);
}

TEST(ScanSpan, IsWalkedOverAsScansAndKeptAsShared) {
  std::vector<std::shared_ptr<const PolarScan>> scans;
  for (std::uint64_t n = 0; n < 3; ++n) {
    scans.push_back(std::make_shared<PolarScan>());
    std::const_pointer_cast<PolarScan>(scans.back())->sequence = n;
  }
  const ScanSpan span(scans);
  std::uint64_t expected = 0;
  for (const PolarScan& scan : span) EXPECT_EQ(scan.sequence, expected++);
  EXPECT_EQ(expected, 3U);
  EXPECT_EQ(span.back().sequence, 2U);
  EXPECT_EQ(span.shared(1).get(), &span[1]);
  EXPECT_TRUE(ScanSpan().empty());
}

}  // namespace
}  // namespace striper
