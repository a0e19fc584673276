// SPDX-License-Identifier: Apache-2.0
// Proves: the list of fields of every ROS 2 message is ROS 2's, by its published hash; texts have
// the form that readers of ros2msg expect; and our own messages are frozen: a changed field changes
// a hash here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/wire/cdr.hpp>

#include "wire/sha256.hpp"

namespace striper::wire {
namespace {

using ::testing::HasSubstr;

TEST(Sha256, IsThatOfTheStandard) {
  // NIST's examples for FIPS 180-4: one block, two blocks; and nothing.
  EXPECT_EQ(detail::sha256_hex("abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(detail::sha256_hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(detail::sha256_hex(""),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

// As ROS 2 Iron and later publish them.
TEST(SchemaOf, HasTheHashesOfRos2) {
  const auto hash = [](const MessageSchema& schema) { return schema.type_hash; };
  EXPECT_EQ(hash(schema_of<Header>()),
            "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01");
  EXPECT_EQ(hash(schema_of<LaserScan>()),
            "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828");
  EXPECT_EQ(hash(schema_of<PointCloud2>()),
            "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5");
  EXPECT_EQ(hash(schema_of<Image>()),
            "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47");
  EXPECT_EQ(hash(schema_of<CompressedImage>()),
            "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a");
  EXPECT_EQ(hash(schema_of<CameraInfo>()),
            "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275");
  EXPECT_EQ(hash(schema_of<DiagnosticArray>()),
            "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e");
  EXPECT_EQ(hash(schema_of<TFMessage>()),
            "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087");
  EXPECT_EQ(hash(schema_of<ParticipantEntitiesInfo<kGidBytesOfIron>>()),
            "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e");
}

// Files hold these messages: a field that is added, renamed or moved needs a message of another
// name (CONVENTIONS.md, "Messages"). The hashes are those of the fields that are listed there.
TEST(SchemaOf, OurOwnMessagesAreFrozen) {
  EXPECT_EQ(schema_of<PolarScan>().type_hash,
            "RIHS01_1228c26c24bab4fdfc402d89a93f457c6ef0d131d0e13ea8c3b918a89c869e5b");
  EXPECT_EQ(schema_of<FrameInfo>().type_hash,
            "RIHS01_b1e407e918bdfd2cb79b40c1cfc32b471e87da09747bd7f8323d6b5495197129");
  EXPECT_EQ(schema_of<Odometer>().type_hash,
            "RIHS01_c95bff0a9261d5dcc5391b7471c7b28e419969f1834ef2250421733130ab242c");
  EXPECT_EQ(schema_of<Event>().type_hash,
            "RIHS01_c8dd6f27733bd308f50b44a56546f76c4a1be1e3d671234548b0755921abbada");
  EXPECT_EQ(schema_of<Curbs>().type_hash,
            "RIHS01_2883d33c4163a9009030b54e1f9d1ea77761db9be7de90ae495523bbe557af09");
  EXPECT_EQ(schema_of<Objects>().type_hash,
            "RIHS01_d1fc4d2b5fa002086ce70ecbb1cf8880b77fa46ea9bbbd4df8f0bf3e1aacd4da");
}

TEST(SchemaOf, TextHasTheUsedTypesBehindIt) {
  const std::string line(80, '=');
  EXPECT_EQ(schema_of<Odometer>().text,
            "std_msgs/Header header\nint64 counts\nfloat64 yaw_rate_rad_s\n" + line +
                "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" + line +
                "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n");
  EXPECT_EQ(schema_of<Odometer>().name, "striper_msgs/msg/Odometer");
  EXPECT_THAT(schema_of<CameraInfo>().text,
              HasSubstr("float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n"));
  EXPECT_THAT(schema_of<PointCloud2>().text, HasSubstr("uint8 FLOAT32=7\n"));
  EXPECT_THAT(schema_of<DiagnosticArray>().text, HasSubstr("byte level\n"));
  EXPECT_THAT(schema_of<ParticipantEntitiesInfo<kGidBytesOfIron>>().text,
              HasSubstr("string<=256 node_name\nrmw_dds_common/Gid[] reader_gid_seq\n"));
}

}  // namespace
}  // namespace striper::wire
