// SPDX-License-Identifier: Apache-2.0
// Proves the whole path from image files to ranges on real images with published numbers. It
// does not prove accuracy to a pixel: the published plane is itself 2 mm off (its own authors'
// points say so).
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/capture/open_source.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/pipeline/scanner.hpp>

#include "support/shared_data.hpp"

namespace striper {
namespace {

constexpr std::chrono::milliseconds kTimeout{1000};

// Scans every frame of a source and hands each scan on.
template <typename Action>
int scan_all(FrameSource& source, Scanner& scanner, const Action& action) {
  source.start();
  int frames = 0;
  Frame frame;
  while (source.next(frame, kTimeout) == NextStatus::kFrame) {
    ++frames;
    for (const PolarScan& scan : scanner.process(frame)) action(scan);
  }
  for (const PolarScan& scan : scanner.finish()) action(scan);
  return frames;
}

ScannerOptions paper_method(ScannerOptions options) {
  options.stripe.method = ExtractMethod::kPaper;
  return options;
}

using Points = std::vector<Eigen::Vector2d>;

// Distances from the line that most of the points lie on: least squares, leaving out what is far
// off, again.
std::vector<double> distances_from_line_m(const Points& points) {
  Points kept = points;
  std::vector<double> distances;
  for (int round = 0; round < 8; ++round) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& p : kept) mean += p / static_cast<double>(kept.size());
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    for (const Eigen::Vector2d& p : kept) scatter += (p - mean) * (p - mean).transpose();
    const Eigen::Vector2d normal =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(scatter).eigenvectors().col(0);
    distances.clear();
    for (const Eigen::Vector2d& p : points) distances.push_back(std::abs(normal.dot(p - mean)));
    std::vector<double> sorted = distances;
    std::sort(sorted.begin(), sorted.end());
    const double limit = 4.0 * sorted[sorted.size() / 2];
    kept.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (distances[i] <= limit) kept.push_back(points[i]);
    }
  }
  return distances;
}

TEST(RealImages, GreenLaserOnATurntableGivesThePublishedWorkspace) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("srv-green-laser-turntable");
  const StriperModel model = load_model(testing::source_path("tests/end_to_end/srv_striper.yaml"));
  const auto source = open_source("images:" + (testing::real_data("srv-green-laser-turntable") /
                                               "turntable_180717_subset/step_num*")
                                                  .string());
  Scanner scanner(model, paper_method(ScannerOptions::for_model(model)));
  std::size_t good = 0;
  std::size_t in_workspace = 0;
  Points table;
  const int frames = scan_all(*source, scanner, [&](const PolarScan& scan) {
    for (const Return& r : scan.returns) {
      if (r.status != ReturnStatus::kOk) continue;
      ++good;
      const Eigen::Vector2d point(r.x_m, r.y_m);
      // The wall behind is half a metre away, the near rim of the table a quarter.
      if (r.range_m > 0.25 && r.range_m < 0.6) ++in_workspace;
      // The last frame shows the bare table: the stripe runs down to the right.
      const bool on_table = r.v_px > 275.0 && r.v_px < 415.0 && r.u_px > 285.0 && r.u_px < 420.0;
      if (scan.sequence == 31 && on_table) table.push_back(point);
    }
  });
  EXPECT_EQ(frames, 32);
  EXPECT_GT(good, static_cast<std::size_t>(frames) * 480 / 4);
  EXPECT_GT(static_cast<double>(in_workspace) / static_cast<double>(good), 0.98);
  ASSERT_GT(table.size(), 100U);
  std::vector<double> distances = distances_from_line_m(table);
  std::sort(distances.begin(), distances.end());
  EXPECT_LT(distances[distances.size() / 2], 0.0005) << "from the table, which is flat";
  EXPECT_LT(distances[distances.size() * 95 / 100], 0.003);
}

std::map<ReturnStatus, double> parts_of_rover_columns(const ScannerOptions& options) {
  const auto source =
      open_source("images:" + (testing::real_data("neil-rover-striper") / "*.jpg").string());
  Scanner scanner(options);
  std::map<ReturnStatus, double> parts;
  double columns = 0.0;
  scan_all(*source, scanner, [&](const PolarScan& scan) {
    columns += static_cast<double>(scan.returns.size());
    for (const Return& r : scan.returns) parts[r.status] += 1.0;
  });
  EXPECT_GT(columns, 10'000.0);
  for (auto& [status, part] : parts) part /= columns;
  return parts;
}

// Which of the columns are right is real_choice_test.cpp's to say.
TEST(RealImages, RoverHasOneWidthInNearlyEveryColumn) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("neil-rover-striper");
  auto paper = parts_of_rover_columns(paper_method(ScannerOptions()));
  EXPECT_GE(paper[ReturnStatus::kOk], 0.95);
  auto refined = parts_of_rover_columns(ScannerOptions());
  EXPECT_LE(refined[ReturnStatus::kNarrow] + refined[ReturnStatus::kWide], 0.02);
}

// ---- Images of a laser that is always on: no dark exposure may be seen in them.

struct AlwaysLitSet {
  const char* set;     // A folder of real data.
  const char* images;  // Within it.
  StripeAxis axis = StripeAxis::kColumns;
};
void PrintTo(const AlwaysLitSet& set, std::ostream* out) { *out << set.set << '/' << set.images; }

constexpr int kFirstFrames = 10;

struct ScannedSet {
  std::size_t scans = 0;
  std::size_t ok = 0;
  AmbientStatus status;
};

// Every `stride`-th frame.
ScannedSet scan_first(const AlwaysLitSet& set, const char* pattern, int stride) {
  const auto source = open_source("images:" + (testing::real_data(set.set) / set.images).string());
  ScannerOptions options;
  options.ambient.pattern = IlluminationPattern::parse(pattern);
  options.stripe.axis = set.axis;
  Scanner scanner(options);
  ScannedSet result;
  const auto count = [&](ScanSpan scans) {
    for (const PolarScan& scan : scans) {
      ++result.scans;
      for (const Return& r : scan.returns) result.ok += r.status == ReturnStatus::kOk ? 1 : 0;
    }
  };
  source->start();
  Frame frame;
  std::uint64_t scanned = 0;
  for (int i = 0; scanned < kFirstFrames; ++i) {
    if (source->next(frame, kTimeout) != NextStatus::kFrame) break;
    if (i % stride != 0) continue;
    frame.sequence = scanned++;
    count(scanner.process(frame));
  }
  count(scanner.finish());
  result.status = scanner.status().ambient;
  return result;
}

class AlwaysLit : public ::testing::TestWithParam<AlwaysLitSet> {};

TEST_P(AlwaysLit, NoDarkExposureIsInvented) {
  const AlwaysLitSet& set = GetParam();
  STRIPER_SKIP_WITHOUT_REAL_DATA(set.set);
  for (const int stride : {1, 2, 3}) {
    SCOPED_TRACE(::testing::Message() << "every " << stride << " frames");
    const ScannedSet found = scan_first(set, "auto", stride);
    const ScannedSet given = scan_first(set, "0", stride);
    EXPECT_GT(given.ok, 0U);
    EXPECT_EQ(found.scans, given.scans);
    EXPECT_EQ(found.ok, given.ok);
    EXPECT_EQ(found.status.pattern, IlluminationPattern::parse("0"));
    EXPECT_EQ(found.status.origin, PatternOrigin::kAssumed);
  }
}

INSTANTIATE_TEST_SUITE_P(
    RealImages, AlwaysLit,
    ::testing::Values(
        AlwaysLitSet{"blaser-cmu", "handheld_1280x720"},
        AlwaysLitSet{"anugrah-step-scans", "05.08_Pyramid", StripeAxis::kRows},
        AlwaysLitSet{"anugrah-step-scans", "1mm_no_object", StripeAxis::kRows},
        AlwaysLitSet{"anugrah-step-scans", "1mmscan_cube", StripeAxis::kRows},
        AlwaysLitSet{"anugrah-step-scans", "1mmscan_stairs", StripeAxis::kRows},
        AlwaysLitSet{"anugrah-step-scans", "New_3level_staris31-07", StripeAxis::kRows},
        AlwaysLitSet{"anugrah-step-scans", "Reference_31-07", StripeAxis::kRows},
        AlwaysLitSet{"b33-handheld-known-distance", "cal_theta_in", StripeAxis::kRows},
        AlwaysLitSet{"srv-green-laser-turntable", "laser_180717", StripeAxis::kRows},
        AlwaysLitSet{"srv-green-laser-turntable", "turntable_180717_subset", StripeAxis::kRows},
        AlwaysLitSet{"neil-rover-striper", "*.jpg"}));

}  // namespace
}  // namespace striper
