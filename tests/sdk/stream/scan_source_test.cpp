// SPDX-License-Identifier: Apache-2.0
// Proves that a loop over a source sees each scan once, waits for a silent source, ends where it
// ends or is stopped, and passes on what `next` throws.
#include <deque>
#include <ranges>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/stream/scan_source.hpp>

#include "support/error_of.hpp"
#include "support/made_scans.hpp"

namespace striper {
namespace {

static_assert(std::ranges::input_range<ScanSource>);

// Answers as it was told to; then kEnd for ever.
class ToldSource : public ScanSource {
 public:
  explicit ToldSource(std::deque<NextStatus> answers) : answers_(std::move(answers)) {}

  HeadInfo info() const override { return {}; }

  NextStatus next(PolarScan& scan, std::chrono::milliseconds /*timeout*/) override {
    if (answers_.empty()) {
      if (throws_at_end) throw Error(ErrorKind::kBadFile, "line 7");
      return NextStatus::kEnd;
    }
    const NextStatus answer = answers_.front();
    answers_.pop_front();
    if (answer == NextStatus::kFrame) scan = testing::made_scan(given_++);
    return answer;
  }

  bool throws_at_end = false;

 private:
  std::deque<NextStatus> answers_;
  std::uint64_t given_ = 0;
};

constexpr NextStatus kScan = NextStatus::kFrame;

std::vector<std::uint64_t> sequences_of(ScanSource& source) {
  std::vector<std::uint64_t> sequences;
  for (const PolarScan& scan : source) sequences.push_back(scan.sequence);
  return sequences;
}

using Sequences = std::vector<std::uint64_t>;

TEST(ScanSource, LoopSeesEachScanOnce) {
  ToldSource source({kScan, kScan, kScan});
  EXPECT_EQ(sequences_of(source), (Sequences{0, 1, 2}));
  EXPECT_EQ(sequences_of(source), Sequences{});
}

TEST(ScanSource, LoopWaitsForASilentSource) {
  ToldSource source({NextStatus::kTimeout, kScan, NextStatus::kTimeout, NextStatus::kTimeout, kScan,
                     NextStatus::kTimeout});
  EXPECT_EQ(sequences_of(source), (Sequences{0, 1}));
}

TEST(ScanSource, LoopEndsWhereItIsStopped) {
  ToldSource source({kScan, NextStatus::kStopped, kScan});
  EXPECT_EQ(sequences_of(source), Sequences{0});
  EXPECT_EQ(sequences_of(source), Sequences{1});
}

TEST(ScanSource, LoopLeftEarlyGoesOnWithTheNextScan) {
  ToldSource source({kScan, kScan, kScan});
  for (const PolarScan& scan : source) {
    if (scan.sequence == 0) break;
  }
  EXPECT_EQ(sequences_of(source), (Sequences{1, 2}));
}

TEST(ScanSource, LoopPassesErrorsOn) {
  ToldSource source({kScan});
  source.throws_at_end = true;
  EXPECT_EQ(testing::error_of([&] { sequences_of(source); }).kind(), ErrorKind::kBadFile);
}

}  // namespace
}  // namespace striper
