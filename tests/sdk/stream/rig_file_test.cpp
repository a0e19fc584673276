// SPDX-License-Identifier: Apache-2.0
// Proves that a rig's heads, options and odometer are read, with paths beside its file, and that
// what is wrong is refused by line, field and value.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/stream/rig_file.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

const std::string kTwoHeads = R"(striper_rig: 1
name: truck
heads:
  - {name: front, source: 'sim:road.yaml', model: front.yaml, options: {min_range: 0.5}}
  - name: rear
    source: gige:camera
    model: /models/rear.yaml
    T_rig_head: {rows: 4, cols: 4, data: [0, -1, 0, -2, 1, 0, 0, 0.5, 0, 0, 1, 0, 0, 0, 0, 1]}
odometer: {source: 'can:can0', counts_per_m: 38.5, bits: 16}
)";

// The rig with one of its texts put in place of another.
std::string with(const std::string& old, const std::string& put) {
  std::string text = kTwoHeads;
  return text.replace(text.find(old), old.size(), put);
}

TEST(RigFile, HasHeadsOptionsAndOdometer) {
  const RigFile rig = parse_rig(kTwoHeads, "/rigs/truck.yaml");
  EXPECT_EQ(rig.name, "truck");
  ASSERT_EQ(rig.heads.size(), 2U);
  EXPECT_EQ(rig.heads[0].source, "sim:/rigs/road.yaml");
  EXPECT_EQ(rig.heads[0].model, "/rigs/front.yaml");
  EXPECT_EQ(rig.heads[0].options.size(), 1U);
  EXPECT_EQ(rig.heads[0].options.at("min_range"), "0.5");
  EXPECT_TRUE(rig.heads[0].T_rig_head.isIdentity(0.0));
  EXPECT_EQ(rig.heads[1].source, "gige:camera");
  EXPECT_EQ(rig.heads[1].model, "/models/rear.yaml");
  EXPECT_EQ(rig.heads[1].T_rig_head(0, 3), -2.0);
  ASSERT_TRUE(rig.odometer.has_value());
  EXPECT_EQ(rig.odometer->source, "can:can0");
  EXPECT_EQ(rig.odometer->counts_per_m, 38.5);
  EXPECT_EQ(rig.odometer->bits, 16);
}

TEST(RigFile, IsRefusedByLineFieldAndValue) {
  struct Case {
    std::string text;
    std::vector<std::string> said;
  };
  const std::vector<Case> cases{
      {with("striper_rig: 1", "striper_rig: 2"), {"truck.yaml:1", "striper_rig", "2"}},
      {with("name: rear", "name: front"), {"truck.yaml:5", "name", "front"}},
      {with("min_range: 0.5", "min_range: near"), {"truck.yaml:4", "min_range", "near"}},
      {with("min_range: 0.5", "colour: 1"), {"truck.yaml:4", "colour"}},
      {with("0.5, 0, 0, 1,", "0.5, 0, 0, 2,"), {"truck.yaml:8", "T_rig_head"}},
      {with("0.5, 0, 0, 1,", "0.5, 0, 0, .nan,"), {"truck.yaml:8", "T_rig_head"}},
      {with("0.5, 0, 0, 1,", "0.5, 0, 0,"), {"truck.yaml:8", "T_rig_head"}},
      {with("counts_per_m: 38.5", "counts_per_m: 0"), {"truck.yaml:9", "counts_per_m"}},
      {with("counts_per_m: 38.5", "counts_per_m: .inf"), {"truck.yaml:9", "counts_per_m"}},
      {with("bits: 16", "bits: 12"), {"truck.yaml:9", "bits", "12"}},
      {with("odometer:", "odometre:"), {"truck.yaml:9", "odometre"}},
      {"striper_rig: 1\nheads: []\n", {"truck.yaml", "heads"}},
      {"striper_rig: 1\n", {"truck.yaml", "heads"}},
      {"", {"truck.yaml"}},
      {"heads: [", {"truck.yaml"}},
  };
  for (const Case& one : cases) {
    const Error error = testing::error_of([&] { parse_rig(one.text, "truck.yaml"); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadFile) << one.text;
    for (const std::string& said : one.said) EXPECT_THAT(error.what(), HasSubstr(said)) << one.text;
  }
}

TEST(RigFile, ThatIsNotThereIsSaid) {
  EXPECT_EQ(testing::error_of([] { load_rig("/nowhere/rig.yaml"); }).kind(), ErrorKind::kNotFound);
}

}  // namespace
}  // namespace striper
