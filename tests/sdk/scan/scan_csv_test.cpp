// SPDX-License-Identifier: Apache-2.0
// Proves that scans read from CSV and written again give the same file byte for byte, whatever the
// times and numbers; that other people's tables are read with what they have; and that damage is
// refused or cut off. Does not prove that a scan has what the CSV has no column for (its field).
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/scan/scan_csv.hpp>
#include <striper/stream/sinks/csv_sink.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/random.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using testing::ScratchDirectory;
using testing::uniform;

Return random_return(int line, StripeAxis axis) {
  Return r;
  const double across_px = uniform(0, 480);
  r.u_px = axis == StripeAxis::kColumns ? line : across_px;
  r.v_px = axis == StripeAxis::kColumns ? across_px : line;
  r.status = static_cast<ReturnStatus>(static_cast<int>(uniform(0, kReturnStatusCount)));
  if (verdict(r.status) == Verdict::kMissing) return r;
  r.bearing_rad = uniform(-1, 1);
  r.range_m = uniform(0.1, 10);
  r.range_near_m = r.range_m * uniform(0.9, 1);
  r.range_far_m = uniform(0, 1) < 0.1 ? HUGE_VAL : r.range_m * uniform(1, 1.1);
  r.sigma_m = std::exp(uniform(-20, 0));
  r.x_m = uniform(-10, 10);
  r.y_m = uniform(-10, 10);
  r.intensity_dn = static_cast<float>(uniform(0, 255));
  r.width_px = static_cast<float>(uniform(0, 5));
  r.row_sigma_px = static_cast<float>(uniform(0, 1));
  r.confidence = static_cast<float>(uniform(0, 1));
  return r;
}

PolarScan random_scan(int i, StripeAxis axis, std::optional<std::int64_t> utc_offset_ns) {
  PolarScan scan;
  scan.sequence = static_cast<std::uint64_t>(i / 2);
  scan.time.monotonic_ns = static_cast<std::int64_t>(i) * 16'683'333 + 1'234'567'891'234;
  scan.time.utc_offset_ns = utc_offset_ns;
  scan.laser = i % 2;
  scan.axis = axis;
  for (int line = 0; line < 20; ++line) scan.returns.push_back(random_return(line, axis));
  return scan;
}

void write_scans(const std::string& path, const std::vector<PolarScan>& scans) {
  CsvSink sink(path, {.doubtful = true, .missing = true});
  for (const PolarScan& scan : scans) sink.write(scan);
  sink.close();
}

std::vector<PolarScan> read_scans(const std::string& path) {
  ScanCsvReader reader{std::filesystem::path(path)};
  std::vector<PolarScan> scans;
  for (PolarScan scan; reader.next(scan);) scans.push_back(scan);
  EXPECT_EQ(reader.cut_line(), 0U);
  return scans;
}

std::vector<PolarScan> scans_in(const std::string& text, const ScanCsvOptions& options = {},
                                std::size_t* cut_line = nullptr) {
  ScanCsvReader reader(CsvInput::of_text("s.csv", text), options);
  std::vector<PolarScan> scans;
  for (PolarScan scan; reader.next(scan);) scans.push_back(scan);
  if (cut_line != nullptr) *cut_line = reader.cut_line();
  return scans;
}

TEST(ScanCsv, ReadingAndWritingAgainGivesTheSameFile) {
  const ScratchDirectory scratch;
  // Without a clock, and since 1970, where doubles are 238 ns apart.
  for (const std::optional<std::int64_t> offset_ns :
       {std::optional<std::int64_t>(), std::optional<std::int64_t>(1'795'400'000'123'456'789)}) {
    for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
      std::vector<PolarScan> scans;
      for (int i = 0; i < 300; ++i) scans.push_back(random_scan(i, axis, offset_ns));
      write_scans(scratch / "a.csv", scans);
      const std::vector<PolarScan> again = read_scans(scratch / "a.csv");
      ASSERT_EQ(again.size(), scans.size());
      EXPECT_EQ(again[7].axis, axis);
      EXPECT_EQ(again[7].time.utc_offset_ns.has_value(), offset_ns.has_value());
      EXPECT_EQ(again[7].returns.size(), 20U);
      write_scans(scratch / "b.csv", again);
      EXPECT_EQ(testing::read_bytes(scratch / "a.csv"), testing::read_bytes(scratch / "b.csv"));
    }
  }
}

TEST(ScanCsv, ForeignTableNeedsFourColumns) {
  const auto scans = scans_in(
      "bearing_rad,range_m,time_s,frame,weather\n0,2,0.5,7,rain\n1.5707963267948966,3,0.5,7,rain\n"
      "0,,0.5,8,rain\n",
      {.axis = StripeAxis::kRows, .sigma_m = 0.01});
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[0].sequence, 7U);
  EXPECT_EQ(scans[0].time.monotonic_ns, 500'000'000);
  EXPECT_EQ(scans[0].axis, StripeAxis::kRows);
  ASSERT_EQ(scans[0].returns.size(), 2U);
  EXPECT_EQ(scans[0].returns[0].x_m, 2.0);
  EXPECT_EQ(scans[0].returns[1].y_m, 3.0);
  EXPECT_EQ(scans[0].returns[1].sigma_m, 0.01);
  EXPECT_EQ(scans[0].returns[1].status, ReturnStatus::kOk);
  EXPECT_TRUE(std::isnan(scans[0].returns[1].range_far_m));
  EXPECT_EQ(scans[1].returns[0].status, ReturnStatus::kNoStripe);
  EXPECT_TRUE(std::isnan(scans[1].returns[0].sigma_m));
  EXPECT_FALSE(scans[1].is_stripe_seen);

  const Error error = testing::error_of([] { scans_in("frame,time_s,range_m\n"); });
  EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
  EXPECT_THAT(error.what(), HasSubstr("no column 'bearing_rad': it is no table of scans"));
}

TEST(ScanCsv, ScansAreToldApartByFrameTimeAndLaser) {
  const auto scans = scans_in(
      "frame,time_s,laser,bearing_rad,range_m\n1,1,0,0,1\n1,1,1,0,1\n1,1.5,1,0,1\n2,1.5,1,0,1\n"
      "2,1.5,1,0,1\n");
  ASSERT_EQ(scans.size(), 4U);
  EXPECT_EQ(scans[1].laser, 1);
  EXPECT_EQ(scans[3].returns.size(), 2U);
}

TEST(ScanCsv, DamageIsNamedAndACutOffEndLeftOut) {
  const std::string header = "frame,time_s,bearing_rad,range_m,status\n";
  const auto message = [&](const std::string& line) {
    return std::string(testing::error_of([&] { scans_in(header + line); }).what());
  };
  EXPECT_THAT(message("1,1,0,1,fine\n"),
              HasSubstr("'s.csv' line 2: column 'status' cannot be 'fine' - expected one of ok, "));
  EXPECT_THAT(message("1,,0,1,ok\n"),
              HasSubstr("column 'time_s' cannot be '' - expected a finite"));
  EXPECT_THAT(message("1,inf,0,1,ok\n"), HasSubstr("column 'time_s' cannot be 'inf'"));
  EXPECT_THAT(message("-1,1,0,1,ok\n"), HasSubstr("column 'frame' cannot be '-1'"));
  EXPECT_THAT(message("1,1,0,nan,ok\n"), HasSubstr("column 'range_m' cannot be 'nan'"));
  std::size_t cut_line = 0;
  const auto scans = scans_in(header + "1,1,0,1,ok\n1,1,0,1,o", {}, &cut_line);
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].returns.size(), 1U);
  EXPECT_EQ(cut_line, 3U);
}

TEST(ScanCsv, BearingsInDegreesAreRefused) {
  const std::string head = "frame,time_s,bearing_rad,range_m\n";
  EXPECT_EQ(scans_in(head + "0,0,-6.28,1\n0,0,6.2831855,1\n").size(), 1U);
  const Error error = testing::error_of([&] { scans_in(head + "0,0,1,1\n0,0,27.5,1\n"); });
  EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
  EXPECT_THAT(error.what(),
              HasSubstr("'s.csv' line 3: bearing_rad is 27.5, more than a whole turn"));
}

TEST(ScanCsv, ScansCostNoAllocation) {
  const ScratchDirectory scratch;
  std::vector<PolarScan> scans;
  for (int i = 0; i < 100; ++i) scans.push_back(random_scan(i, StripeAxis::kColumns, 0));
  write_scans(scratch / "a.csv", scans);
  ScanCsvReader reader(scratch / "a.csv");
  PolarScan scan;
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(reader.next(scan));
  const testing::AllocationCounter counter;
  int count = 50;
  while (reader.next(scan)) ++count;
  EXPECT_EQ(counter.count(), 0U);
  EXPECT_EQ(count, 100);
}

}  // namespace
}  // namespace striper
