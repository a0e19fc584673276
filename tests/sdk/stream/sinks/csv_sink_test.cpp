// SPDX-License-Identifier: Apache-2.0
// Proves that the CSV has the agreed header, that floats read back to the same bits, that what does
// not exist is an empty field, and that a full disk leaves whole lines and a message.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <striper/core/error.hpp>
#include <striper/stream/sinks/csv_sink.hpp>

#include "support/error_of.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

constexpr const char* kHeader =
    "frame,time_s,laser,u_px,v_px,bearing_rad,range_m,range_near_m,range_far_m,sigma_m,sigma_cal_m,"
    "x_m,y_m,"
    "intensity,width_px,row_sigma_px,confidence,status";

class CsvSinkTest : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }

  std::vector<std::string> lines() const {
    std::ifstream file(path_);
    std::vector<std::string> out;
    for (std::string line; std::getline(file, line);) out.push_back(line);
    return out;
  }

  std::string path_ = ::testing::TempDir() + "striper_csv_sink_test_" +
                      ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv";
};

PolarScan scan_of(std::vector<Return> returns) {
  PolarScan scan;
  scan.sequence = 7;
  scan.time.monotonic_ns = 250'000'000;
  scan.returns = std::move(returns);
  return scan;
}

Return good_return() {
  Return r;
  r.u_px = 12;
  r.v_px = 200.125;
  r.bearing_rad = -0.1;
  r.range_m = 2.0;
  r.range_near_m = 1.9;
  r.range_far_m = std::numeric_limits<double>::infinity();
  r.sigma_m = 0.001;
  r.x_m = 1.5;
  r.y_m = -0.5;
  r.intensity_dn = 91.5F;
  r.width_px = 0.7F;
  r.row_sigma_px = 0.05F;
  r.confidence = 1.0F;
  r.status = ReturnStatus::kOk;
  return r;
}

TEST_F(CsvSinkTest, WritesTheAgreedHeaderAndFields) {
  CsvSink sink(path_);
  sink.write(scan_of({good_return()}));
  sink.close();
  ASSERT_EQ(lines().size(), 2U);
  EXPECT_EQ(lines()[0], kHeader);
  EXPECT_EQ(lines()[1], "7,0.25,0,12,200.125,-0.1,2,1.9,inf,0.001,,1.5,-0.5,91.5,0.7,0.05,1,ok");
}

TEST_F(CsvSinkTest, WritesDoubtfulAndMissingReturnsOnlyWhenAsked) {
  Return doubtful = good_return();
  doubtful.status = ReturnStatus::kEdge;
  Return missing;
  missing.u_px = 3;
  const PolarScan scan = scan_of({good_return(), doubtful, missing});
  const auto count = [&](const CsvOptions& options) {
    CsvSink sink(path_, options);
    sink.write(scan);
    EXPECT_EQ(sink.lines() + 1, (sink.close(), lines().size()));
    return sink.lines();
  };
  EXPECT_EQ(count({}), 1U);
  EXPECT_EQ(count({.doubtful = true}), 2U);
  EXPECT_EQ(count({.doubtful = true, .missing = true}), 3U);
  EXPECT_EQ(lines()[3], "7,0.25,0,3,,,,,,,,,,,,,,no_stripe");
}

TEST_F(CsvSinkTest, NumbersReadBackToTheSameBits) {
  std::vector<Return> returns;
  for (int i = 0; i < 500; ++i) {
    Return r = good_return();
    r.v_px = testing::uniform(-1e3, 1e3);
    r.range_m = std::exp(testing::uniform(-300, 300));
    r.width_px = static_cast<float>(testing::uniform(0, 5));
    returns.push_back(r);
  }
  CsvSink sink(path_);
  sink.write(scan_of(returns));
  sink.close();
  const std::vector<std::string> text = lines();
  for (std::size_t i = 0; i < returns.size(); ++i) {
    std::istringstream fields(text[i + 1]);
    std::vector<std::string> field;
    for (std::string f; std::getline(fields, f, ',');) field.push_back(f);
    EXPECT_EQ(std::strtod(field[4].c_str(), nullptr), returns[i].v_px);
    EXPECT_EQ(std::strtod(field[6].c_str(), nullptr), returns[i].range_m);
    EXPECT_EQ(std::strtof(field[14].c_str(), nullptr), returns[i].width_px);
  }
}

TEST_F(CsvSinkTest, PathThatCannotBeWrittenIsNamed) {
  const Error error = testing::error_of([] { CsvSink("/no/such/folder/scans.csv"); });
  EXPECT_EQ(error.kind(), ErrorKind::kIo);
  EXPECT_THAT(error.what(), HasSubstr("'/no/such/folder/scans.csv': No such file or directory"));
}

TEST_F(CsvSinkTest, FullDiskLeavesWholeLines) {
  // A limit on the file's size stands in for the disk: write() then fails in the middle of a scan.
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  rlimit limit = old_limit;
  limit.rlim_cur = 10'000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  CsvSink sink(path_);
  const PolarScan scan = scan_of(std::vector<Return>(64, good_return()));
  std::string message;
  for (int i = 0; i < 100 && message.empty(); ++i) {
    try {
      sink.write(scan);
    } catch (const Error& error) {
      message = error.what();
    }
  }
  setrlimit(RLIMIT_FSIZE, &old_limit);
  EXPECT_THAT(message, HasSubstr(path_));
  const std::vector<std::string> text = lines();
  ASSERT_GT(text.size(), 64U);
  for (std::size_t i = 1; i < text.size(); ++i) EXPECT_EQ(text[i], text[1]);
  EXPECT_EQ(std::filesystem::file_size(path_),
            std::string(kHeader).size() + 1 + (text.size() - 1) * (text[1].size() + 1));
}

}  // namespace
}  // namespace striper
