// SPDX-License-Identifier: Apache-2.0
// Proves: files of points have the layout that their formats' specifications say, read back here
// byte by byte; points without coordinates are left out of PLY and LAS and kept in PCD; the file is
// whole after every flush. That other programs read them is tests/foreign's business.
#include <cmath>
#include <cstring>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/wire/point_file.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/random.hpp"

namespace striper::wire {
namespace {

using ::testing::HasSubstr;

/// Two scans of three points, the second of the first scan missing.
std::vector<std::vector<CloudPoint>> two_scans() {
  std::vector<std::vector<CloudPoint>> scans(2, std::vector<CloudPoint>(3));
  for (auto& scan : scans) {
    for (CloudPoint& point : scan) {
      const auto any = [] { return static_cast<float>(striper::testing::uniform(-5.0, 5.0)); };
      point = {any(), any(), any(), 100.0F, any(),
               any(), any(), any(), 3,      striper::testing::uniform(0.0, 2e9)};
    }
  }
  scans[0][1] = CloudPoint{};
  scans[0][1].status = 8;
  return scans;
}

std::string file_of(PointFormat format, const std::vector<std::vector<CloudPoint>>& scans) {
  std::ostringstream stream;
  const auto file = make_point_file(format, stream);
  for (const auto& scan : scans) file->write(scan);
  file->flush();
  return stream.str();
}

template <typename T>
T number_at(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// A point of 41 bytes as PLY and PCD have it.
void expect_point(const std::string& bytes, std::size_t at, const CloudPoint& point) {
  const float values[] = {point.x_m,     point.y_m,         point.z_m,      point.intensity,
                          point.sigma_m, point.sigma_cal_m, point.width_px, point.confidence};
  for (const float value : values) {
    const auto written = number_at<float>(bytes, at);
    EXPECT_TRUE(written == value || (std::isnan(written) && std::isnan(value))) << value;
    at += sizeof value;
  }
  EXPECT_EQ(number_at<std::uint8_t>(bytes, at), point.status);
  EXPECT_EQ(number_at<double>(bytes, at + 1), point.time_s);
}

TEST(PointFile, PlyHasThePointsThatAreThere) {
  const auto scans = two_scans();
  const std::string bytes = file_of(PointFormat::kPly, scans);
  const std::size_t begin = bytes.find("end_header\n") + 11;
  EXPECT_THAT(bytes.substr(0, begin), HasSubstr("format binary_little_endian 1.0\n"));
  EXPECT_THAT(bytes.substr(0, begin), HasSubstr("element vertex 0000000005\nproperty float x\n"));
  ASSERT_EQ(bytes.size(), begin + 5 * 41);
  const CloudPoint* there[] = {&scans[0][0], &scans[0][2], &scans[1][0], &scans[1][1],
                               &scans[1][2]};
  for (std::size_t i = 0; i < 5; ++i) expect_point(bytes, begin + i * 41, *there[i]);
}

TEST(PointFile, PcdKeepsScansOrganised) {
  const auto scans = two_scans();
  const std::string bytes = file_of(PointFormat::kPcd, scans);
  const std::size_t begin = bytes.find("DATA binary\n") + 12;
  EXPECT_THAT(bytes, HasSubstr("WIDTH 0000000003\nHEIGHT 0000000002\n"));
  EXPECT_THAT(bytes, HasSubstr("POINTS 0000000006\n"));
  ASSERT_EQ(bytes.size(), begin + 6 * 41);
  for (std::size_t i = 0; i < 6; ++i) expect_point(bytes, begin + i * 41, scans[i / 3][i % 3]);
}

TEST(PointFile, PcdOfScansOfUnequalLengthsIsAList) {
  auto scans = two_scans();
  scans[1].pop_back();
  EXPECT_THAT(file_of(PointFormat::kPcd, scans),
              HasSubstr("WIDTH 0000000005\nHEIGHT 0000000001\n"));
}

TEST(PointFile, LasHasTheHeaderOfTheSpecification) {
  const auto scans = two_scans();
  const std::string bytes = file_of(PointFormat::kLas, scans);
  constexpr std::size_t kPoints = 227 + 54 + 2 * 192;
  EXPECT_EQ(bytes.substr(0, 4), "LASF");
  EXPECT_EQ(number_at<std::uint16_t>(bytes, 24), 0x0201);
  EXPECT_STREQ(bytes.data() + 26, "Striper; intensity 257 / DN");
  EXPECT_EQ(number_at<std::uint16_t>(bytes, 94), 227);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 96), kPoints);
  EXPECT_EQ(number_at<std::uint8_t>(bytes, 104), 1);
  EXPECT_EQ(number_at<std::uint16_t>(bytes, 105), 36);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 107), 5U);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 111), 5U);
  EXPECT_EQ(number_at<double>(bytes, 131), 1e-5);
  double greatest = scans[0][0].x_m;
  for (const auto& scan : scans) {
    for (const CloudPoint& point : scan) greatest = std::fmax(greatest, point.x_m);
  }
  EXPECT_EQ(number_at<double>(bytes, 179), greatest);
  EXPECT_STREQ(bytes.data() + 227 + 2, "LASF_Spec");
  EXPECT_STREQ(bytes.data() + 227 + 54 + 4, "sigma");
  EXPECT_STREQ(bytes.data() + 227 + 54 + 192 + 4, "sigma_cal");
  EXPECT_EQ(bytes.size(), kPoints + 5 * 36);
}

TEST(PointFile, LasHasThePointsToItsStep) {
  const auto scans = two_scans();
  const std::string bytes = file_of(PointFormat::kLas, scans);
  const std::size_t last = bytes.size() - 36;
  const CloudPoint& point = scans[1][2];
  EXPECT_NEAR(number_at<std::int32_t>(bytes, last) * 1e-5, point.x_m, 0.51e-5);
  EXPECT_NEAR(number_at<std::int32_t>(bytes, last + 4) * 1e-5, point.y_m, 0.51e-5);
  EXPECT_NEAR(number_at<std::int32_t>(bytes, last + 8) * 1e-5, point.z_m, 0.51e-5);
  EXPECT_EQ(number_at<std::uint16_t>(bytes, last + 12), 25700);
  EXPECT_EQ(number_at<std::uint8_t>(bytes, last + 14), 9);
  EXPECT_EQ(number_at<std::uint8_t>(bytes, last + 17), 3);
  EXPECT_EQ(number_at<double>(bytes, last + 20), point.time_s);
  EXPECT_EQ(number_at<float>(bytes, last + 28), point.sigma_m);
  EXPECT_EQ(number_at<float>(bytes, last + 32), point.sigma_cal_m);
}

TEST(PointFile, LasCountsWhatItCannotHold) {
  std::ostringstream stream;
  const auto file = make_point_file(PointFormat::kLas, stream);
  const CloudPoint far{30'000.0F, 0.0F, 0.0F};
  const CloudPoint near{20'000.0F, 0.0F, 0.0F};
  file->write(std::vector<CloudPoint>{far, near, CloudPoint{}});
  EXPECT_EQ(file->points(), 1U);
  EXPECT_EQ(file->left_out(), 1U);
}

class EveryPointFormat : public ::testing::TestWithParam<PointFormat> {};
INSTANTIATE_TEST_SUITE_P(All, EveryPointFormat,
                         ::testing::Values(PointFormat::kPly, PointFormat::kPcd,
                                           PointFormat::kLas));

TEST_P(EveryPointFormat, IsWholeAfterEveryFlush) {
  const auto scans = two_scans();
  std::ostringstream stream;
  const auto file = make_point_file(GetParam(), stream);
  file->flush();
  EXPECT_EQ(stream.str(), file_of(GetParam(), {}));
  file->write(scans[0]);
  file->flush();
  EXPECT_EQ(stream.str(), file_of(GetParam(), {scans[0]}));
  file->write(scans[1]);
  file->flush();
  EXPECT_EQ(stream.str(), file_of(GetParam(), scans));
}

TEST_P(EveryPointFormat, AFailedStreamIsSaid) {
  const auto scans = two_scans();
  std::ostringstream stream;
  const auto file = make_point_file(GetParam(), stream);
  stream.setstate(std::ios::badbit);
  EXPECT_EQ(striper::testing::error_of([&] { file->write(scans[0]); }).kind(), ErrorKind::kIo);
}

TEST(PointFile, FormatsAreThoseOfTheExtensions) {
  EXPECT_EQ(point_format_from_extension(".pcd"), PointFormat::kPcd);
  EXPECT_EQ(point_format_from_extension(".csv"), std::nullopt);
}

}  // namespace
}  // namespace striper::wire
