// SPDX-License-Identifier: Apache-2.0
// Proves that scans become points of the head's frame in PLY, PCD and LAS, read back here by what
// their headers and specifications say; that doubtful and missing returns are left out, or kept as
// NaN where the format is organised; that the sensor moves by speed and by odometer. The bytes of
// the formats themselves are point_file_test's business.
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/motion/odometer_csv.hpp>
#include <striper/stream/open_sink.hpp>

#include "support/error_of.hpp"
#include "support/made_scans.hpp"
#include "support/models.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

// A table of points: a value per column.
using Table = std::vector<std::map<std::string, double>>;

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <typename T>
T number_at(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

struct Column {
  std::string name;
  std::string type;
};

Table table_of(const std::string& bytes, std::size_t at, const std::vector<Column>& columns) {
  Table table;
  while (at < bytes.size()) {
    auto& row = table.emplace_back();
    for (const Column& column : columns) {
      if (column.type == "float") row[column.name] = number_at<float>(bytes, at);
      if (column.type == "double") row[column.name] = number_at<double>(bytes, at);
      if (column.type == "uchar") row[column.name] = number_at<std::uint8_t>(bytes, at);
      at += column.type == "float" ? 4 : column.type == "double" ? 8 : 1;
    }
  }
  return table;
}

Table read_ply(const std::filesystem::path& path) {
  const std::string bytes = bytes_of(path);
  const std::size_t begin = bytes.find("end_header\n") + 11;
  std::istringstream header(bytes.substr(0, begin));
  std::vector<Column> columns;
  std::size_t count = 0;
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "element") words >> word >> count;
    if (word == "property") {
      columns.emplace_back();
      words >> columns.back().type >> columns.back().name;
    }
  }
  Table table = table_of(bytes, begin, columns);
  EXPECT_EQ(table.size(), count);
  return table;
}

Table read_pcd(const std::filesystem::path& path, std::size_t& width, std::size_t& height) {
  const std::string bytes = bytes_of(path);
  const std::size_t begin = bytes.find("DATA binary\n") + 12;
  std::istringstream header(bytes.substr(0, begin));
  std::vector<Column> columns;
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "WIDTH") words >> width;
    if (word == "HEIGHT") words >> height;
    if (word == "FIELDS") {
      while (words >> word) columns.push_back({word, {}});
    }
    if (word != "SIZE") continue;
    for (Column& column : columns) {
      words >> word;
      column.type = word == "4" ? "float" : word == "8" ? "double" : "uchar";
    }
  }
  return table_of(bytes, begin, columns);
}

// LAS 1.2: the header's places, and point format 1.
Table read_las(const std::filesystem::path& path) {
  const std::string bytes = bytes_of(path);
  const auto begin = number_at<std::uint32_t>(bytes, 96);
  const auto step = number_at<std::uint16_t>(bytes, 105);
  const auto count = number_at<std::uint32_t>(bytes, 107);
  Table table;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = begin + i * step;
    auto& row = table.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      row[std::string(1, "xyz"[axis])] =
          number_at<std::int32_t>(bytes, at + 4 * axis) * number_at<double>(bytes, 131 + 8 * axis) +
          number_at<double>(bytes, 155 + 8 * axis);
    }
    row["time"] = number_at<double>(bytes, at + 20);
  }
  return table;
}

class PointSink : public ::testing::Test {
 protected:
  PointSink() : model_(std::make_shared<const StriperModel>(testing::typical_model())) {
    testing::reseed();
    head_ = head_info("striper", {}, model_, StripeAxis::kColumns);
    for (std::uint64_t n = 0; n < 5; ++n) {
      PolarScan& scan = scans_.emplace_back(testing::made_scan(n, 28));
      scan.frame = head_.frames.front();
      for (Return& one : scan.returns) {
        if (verdict(one.status) == Verdict::kMissing) continue;
        one.x_m = testing::uniform(0.5, 5.0);
        one.y_m = testing::uniform(-2.0, 2.0);
      }
    }
  }

  void write(const std::string& uri) {
    const auto sink = open_sink(uri);
    sink->open(head_);
    for (const PolarScan& scan : scans_) sink->write(scan);
    sink->finish();
  }

  // What the table must be, made the slow way.
  struct Expected {
    Eigen::Vector3d point;
    const Return* value;
    double time_s;
  };
  std::vector<Expected> expected(bool doubtful, double speed_m_s = 0.0) const {
    std::vector<Expected> points;
    const Eigen::Isometry3d T = T_head_cam() * model_->T_cam_scan(0);
    for (const PolarScan& scan : scans_) {
      const double moved = speed_m_s * (scan.time.seconds() - scans_.front().time.seconds());
      for (const Return& one : scan.returns) {
        const Verdict value = verdict(one.status);
        if (value == Verdict::kMissing || (value == Verdict::kDoubtful && !doubtful)) continue;
        points.push_back({T * Eigen::Vector3d(one.x_m, one.y_m, moved), &one, scan.time.seconds()});
      }
    }
    return points;
  }

  static void expect_near(const std::map<std::string, double>& row, const Expected& point,
                          double step_m) {
    EXPECT_NEAR(row.at("x"), point.point.x(), step_m);
    EXPECT_NEAR(row.at("y"), point.point.y(), step_m);
    EXPECT_NEAR(row.at("z"), point.point.z(), step_m);
    EXPECT_EQ(row.at("time"), point.time_s);
  }

  std::string path(const char* name) const { return (scratch_ / name).string(); }

  testing::ScratchDirectory scratch_;
  std::shared_ptr<const StriperModel> model_;
  HeadInfo head_;
  std::vector<PolarScan> scans_;
};

// A float of 5 m is good to 5e-7; LAS is to 1e-5.
constexpr double kFloat_m = 1e-6;
constexpr double kLas_m = 6e-6;

TEST_F(PointSink, PlyHasTheGoodReturnsInTheHeadsFrame) {
  write(path("a.ply"));
  const Table table = read_ply(path("a.ply"));
  const auto points = expected(false);
  ASSERT_EQ(table.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    expect_near(table[i], points[i], kFloat_m);
    EXPECT_EQ(static_cast<float>(table[i].at("intensity")), points[i].value->intensity_dn);
    EXPECT_EQ(table[i].at("status"), 0.0);
    EXPECT_EQ(static_cast<float>(table[i].at("sigma")),
              static_cast<float>(points[i].value->sigma_m));
  }
}

TEST_F(PointSink, DoubtfulReturnsComeWhereTheyAreAskedFor) {
  write(path("a.ply") + "?doubtful=yes");
  const Table table = read_ply(path("a.ply"));
  const auto points = expected(true);
  ASSERT_EQ(table.size(), points.size());
  ASSERT_GT(points.size(), expected(false).size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    expect_near(table[i], points[i], kFloat_m);
    EXPECT_EQ(table[i].at("status"), static_cast<double>(points[i].value->status));
  }
}

TEST_F(PointSink, PcdKeepsARowForEveryScanAndNaNForWhatIsNotGood) {
  write(path("a.pcd"));
  std::size_t width = 0;
  std::size_t height = 0;
  const Table table = read_pcd(path("a.pcd"), width, height);
  EXPECT_EQ(width, 28U);
  EXPECT_EQ(height, scans_.size());
  ASSERT_EQ(table.size(), width * height);
  const auto points = expected(false);
  std::size_t good = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const Return& one = scans_[i / width].returns[i % width];
    EXPECT_EQ(table[i].at("status"), static_cast<double>(one.status));
    EXPECT_EQ(std::isnan(table[i].at("x")), one.status != ReturnStatus::kOk);
    if (one.status == ReturnStatus::kOk) expect_near(table[i], points[good++], kFloat_m);
  }
  EXPECT_EQ(good, points.size());
}

TEST_F(PointSink, LasIsGoodToItsScale) {
  write(path("a.las") + "?speed=2.5");
  const Table table = read_las(path("a.las"));
  const auto points = expected(false, 2.5);
  ASSERT_EQ(table.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) expect_near(table[i], points[i], kLas_m);
}

TEST_F(PointSink, OdometerMovesTheSensorAsAConstantSpeedDoes) {
  constexpr double kSpeed_m_s = 2.0;
  auto odometer = make_odometer_csv(path("odometer.csv"));
  for (int i = -20; i < 60; ++i) {  // Every 10 ms, 1e5 counts a metre.
    const double time_s = scans_.front().time.seconds() + i * 0.01;
    odometer.add({time_s, (i + 20) * 2000, 0.0});
  }
  odometer.close();
  write(path("a.ply") + "?odometer=" + path("odometer.csv") + "&counts_per_m=100000");
  const Table table = read_ply(path("a.ply"));
  const auto points = expected(false, kSpeed_m_s);
  ASSERT_EQ(table.size(), points.size());
  // 0.4 m were driven before the first scan; seconds since 1970 are good to 2.4e-7.
  const Eigen::Vector3d before = head_.frames.front()->T_head_scan.linear().col(2) * 0.4;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Expected moved = points[i];
    moved.point += before;
    expect_near(table[i], moved, 1e-4);
  }
}

TEST_F(PointSink, IsWholeAfterItsSinkDiedUnfinished) {
  {
    const auto sink = open_sink(path("a.ply"));
    sink->open(head_);
    for (const PolarScan& scan : scans_) sink->write(scan);
  }
  EXPECT_EQ(read_ply(path("a.ply")).size(), expected(false).size());
}

TEST_F(PointSink, WrongKeysAndOtherFilesAreRefused) {
  const auto problem = [&](const std::string& uri) {
    return std::string(testing::error_of([&] { open_sink(uri); }).what());
  };
  EXPECT_THAT(problem("ply:a.ply?speeed=1"), HasSubstr("doubtful, speed, odometer"));
  EXPECT_THAT(problem("las:a.las?odometer=a.csv"), HasSubstr("counts_per_m"));
  EXPECT_THAT(problem("pcd:a.pcd?speed=1&odometer=a.csv&counts_per_m=3"),
              HasSubstr("counts_per_m"));
  EXPECT_THAT(problem("ply:-"), HasSubstr("to a file"));
  std::ofstream(path("model.ply")) << "striper_model: 1\n";
  EXPECT_THAT(problem(path("model.ply")), HasSubstr("not overwritten"));
}

TEST_F(PointSink, FullDiskIsNamed) {
  const auto sink = open_sink("ply:/dev/full");
  const Error error = testing::error_of([&] {
    sink->open(head_);
    for (int i = 0; i < 100; ++i) sink->write(scans_.front());
    sink->finish();
  });
  EXPECT_EQ(error.kind(), ErrorKind::kIo);
  EXPECT_THAT(error.what(), HasSubstr("/dev/full"));
}

}  // namespace
}  // namespace striper
