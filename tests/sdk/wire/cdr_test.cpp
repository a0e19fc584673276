// SPDX-License-Identifier: Apache-2.0
// Proves: messages have the bytes that the standard says, worked out by hand; every field of every
// message comes back to the bit, of either byte order; whatever is cut off, too long or absurd is
// refused in words; a stream of messages allocates nothing. That other programs read the same is
// tests/foreign's business.
#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/wire/cdr.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/filled_message.hpp"

namespace striper::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ::striper::testing::error_of;
using ::striper::testing::filled_message;
using ::testing::HasSubstr;

template <typename M>
Bytes bytes_of(const M& message) {
  Bytes bytes;
  write_cdr(message, bytes);
  return bytes;
}

TEST(WriteCdr, HeaderHasTheBytesOfTheStandard) {
  const Header header{{1, 2}, "ab"};
  EXPECT_EQ(bytes_of(header), (Bytes{0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 'a', 'b', 0}));
}

TEST(WriteCdr, NumbersStandAtMultiplesOfTheirSizeBehindTheEncapsulation) {
  Odometer odometer;
  odometer.counts = 3;
  odometer.yaw_rate_rad_s = 1.0;
  // 8 bytes of time, 4 + 1 of an empty text, 3 of padding, then counts at 16.
  EXPECT_EQ(bytes_of(odometer), (Bytes{0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0,    0,   0, 0,
                                       0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f}));
}

TEST(WriteCdr, AnEmptySequenceHasNoPaddingBehindItsLength) {
  PolarScan scan;
  // Header 13, padded to 16; sequence, time: 32; a bool padded, an offset: 48; three bytes padded:
  // 52; fourteen empty arrays of numbers and one of bytes: 4 each.
  EXPECT_EQ(bytes_of(scan).size(), 4U + 52 + 15 * 4);
}

TEST(WriteCdr, ALaserScanOf300RangesHasTheSizeThatOtherImplementationsGiveIt) {
  LaserScan scan;
  scan.header.frame_id = "laser";  // 8 + 4 + 6, padded to 20; seven floats: 48; 4 + 1200; 4 + 1200.
  scan.ranges.resize(300);
  scan.intensities.resize(300);
  EXPECT_EQ(bytes_of(scan).size(), 4U + 48 + 2 * 1204);
}

template <typename M>
class EveryMessage : public ::testing::Test {};
using Messages =
    ::testing::Types<Header, PointField, PointCloud2, LaserScan, Image, CompressedImage, CameraInfo,
                     TFMessage, DiagnosticArray, ParticipantEntitiesInfo<kGidBytesOfHumble>,
                     ParticipantEntitiesInfo<kGidBytesOfIron>, PolarScan, FrameInfo, Odometer,
                     Event>;
TYPED_TEST_SUITE(EveryMessage, Messages);

TYPED_TEST(EveryMessage, ComesBackToTheBit) {
  TypeParam back;  // Used again, so that what the one before left behind would show.
  for (int trial = 0; trial < 200; ++trial) {
    const Bytes bytes = bytes_of(filled_message<TypeParam>());
    read_cdr(std::span<const std::uint8_t>(bytes), back);
    ASSERT_EQ(bytes_of(back), bytes);
  }
}

TYPED_TEST(EveryMessage, CutAnywhereIsRefused) {
  const Bytes bytes = bytes_of(filled_message<TypeParam>());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    TypeParam back;
    const Error error = error_of([&] { read_cdr(std::span(bytes).first(size), back); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
    EXPECT_THAT(error.what(), HasSubstr("at byte"));
  }
}

TYPED_TEST(EveryMessage, BitsFlippedAreReadOrRefusedAndNothingElse) {
  for (int trial = 0; trial < 2000; ++trial) {
    Bytes bytes = bytes_of(filled_message<TypeParam>());
    for (int flips = 0; flips < 3; ++flips) {
      const std::uint64_t bit = striper::testing::random_generator()() % (8 * bytes.size());
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    }
    TypeParam back;
    try {
      read_cdr(std::span<const std::uint8_t>(bytes), back);
    } catch (const Error& error) {
      ASSERT_TRUE(error.kind() == ErrorKind::kBadFile || error.kind() == ErrorKind::kUnsupported);
    }
  }
}

TYPED_TEST(EveryMessage, AbsurdLengthsTakeNoMemory) {
  Bytes bytes(64, 0xff);
  std::memcpy(bytes.data(), "\0\1\0\0", 4);
  TypeParam back;
  EXPECT_THROW(read_cdr(std::span<const std::uint8_t>(bytes), back), Error);
}

TEST(ReadCdr, ReadsTheOtherByteOrder) {
  // 8 bytes of time, 4 + 2 of text, 2 of padding, then counts at 16.
  const Bytes big{0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0,    2,    0, 0, 0, 2, 'a', 0,
                  0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0x3f, 0xf0, 0, 0, 0, 0, 0,   0};
  Odometer odometer;
  read_cdr(std::span<const std::uint8_t>(big), odometer);
  EXPECT_EQ(odometer.header.stamp, (Time{1, 2}));
  EXPECT_EQ(odometer.header.frame_id, "a");
  EXPECT_EQ(odometer.counts, 5);
  EXPECT_EQ(odometer.yaw_rate_rad_s, 1.0);
}

TEST(ReadCdr, TellsWhatIsWrongAndWhere) {
  Header header;
  const auto refusal = [&](const Bytes& bytes) {
    return error_of([&] { read_cdr(std::span<const std::uint8_t>(bytes), header); });
  };
  EXPECT_STREQ(refusal({0, 1}).what(),
               "std_msgs/msg/Header.encapsulation at byte 0: 2 bytes, at least 4 expected");
  EXPECT_EQ(refusal({0, 7, 0, 0}).kind(), ErrorKind::kUnsupported);
  EXPECT_STREQ(
      refusal({0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 255, 255, 255, 255, 'a', 0}).what(),
      "std_msgs/msg/Header.frame_id at byte 16: 4294967295 elements expected, 2 bytes are left");
  EXPECT_STREQ(refusal({0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 'a'}).what(),
               "std_msgs/msg/Header.frame_id at byte 17: the text does not end with a zero");
  EXPECT_STREQ(refusal({0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0}).what(),
               "std_msgs/msg/Header.frame_id at byte 17: 4 bytes behind the last field");
}

TEST(ReadCdr, ABoolIsZeroOrOne) {
  FrameInfo info;
  Bytes bytes = bytes_of(info);
  bytes[4 + 24] = 2;  // sequence 8, two bytes, padding to 16, monotonic_ns to 24.
  EXPECT_STREQ(error_of([&] { read_cdr(std::span<const std::uint8_t>(bytes), info); }).what(),
               "striper_msgs/msg/FrameInfo.has_utc at byte 29: 2 where 0 or 1 is expected");
}

TEST(Cdr, AllocatesNothingInAStream) {
  PolarScan scan;
  scan.header.frame_id = "a_long_name_of_a_frame_scan0";
  for (auto* values : {&scan.u_px, &scan.v_px, &scan.bearing_rad, &scan.range_m})
    values->resize(640);
  Bytes bytes;
  PolarScan back;
  const auto pass = [&] {
    write_cdr(scan, bytes);
    read_cdr(std::span<const std::uint8_t>(bytes), back);
  };
  pass();
  const striper::testing::AllocationCounter counter;
  pass();
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper::wire
