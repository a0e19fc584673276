// SPDX-License-Identifier: Apache-2.0
// Proves which files a directory, a pattern and a name stand for, and in what order.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/images/picture_files.hpp>

#include "support/error_of.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ScratchDirectory;
using testing::write_bytes;

std::vector<std::string> names(const std::string& pattern) {
  std::vector<std::string> result;
  for (const auto& file : image_files(pattern)) result.push_back(file.filename().string());
  return result;
}

Error error_of(const std::string& pattern) {
  return testing::error_of([&] { image_files(pattern); });
}

TEST(ImageFiles, DirectoryGivesItsImageFilesInNaturalOrder) {
  const ScratchDirectory scratch;
  for (const char* name : {"img10.png", "img9.JPG", "img1.tiff", "notes.txt", "frames.csv"}) {
    write_bytes(scratch / name, "x");
  }
  std::filesystem::create_directory(scratch / "deeper.png");
  EXPECT_THAT(names(scratch.path()), ElementsAre("img1.tiff", "img9.JPG", "img10.png"));
}

TEST(ImageFiles, PatternIsExpandedAndLeavesOutWhatIsNoImageFile) {
  const ScratchDirectory scratch;
  for (const char* name : {"a1.png", "a2.png", "a12.png", "b1.png", "a.csv"}) {
    write_bytes(scratch / name, "x");
  }
  EXPECT_THAT(names(scratch / "a*"), ElementsAre("a1.png", "a2.png", "a12.png"));
  EXPECT_THAT(names(scratch / "?1.png"), ElementsAre("a1.png", "b1.png"));
  EXPECT_THAT(names(scratch / "[b-z]*"), ElementsAre("b1.png"));
  EXPECT_THAT(names(scratch / "*.csv"), ElementsAre("a.csv")) << "asked for by name";
}

TEST(ImageFiles, ExistingNameWinsOverItsMeaningAsAPattern) {
  const ScratchDirectory scratch;
  write_bytes(scratch / "shot[1].png", "x");
  write_bytes(scratch / "shot1.png", "x");
  EXPECT_THAT(names(scratch / "shot[1].png"), ElementsAre("shot[1].png"));
}

TEST(ImageFiles, NothingThereIsNotFound) {
  const ScratchDirectory scratch;
  EXPECT_EQ(error_of(scratch.path()).kind(), ErrorKind::kNotFound);
  EXPECT_THAT(error_of(scratch.path()).what(), HasSubstr("holds no image files"));
  EXPECT_EQ(error_of(scratch / "none").kind(), ErrorKind::kNotFound);
  EXPECT_THAT(error_of(scratch / "none").what(), HasSubstr("no such file or directory"));
  EXPECT_THAT(error_of(scratch / "*.png").what(), HasSubstr("no file matches the pattern"));
  EXPECT_EQ(error_of("").kind(), ErrorKind::kUsage);
}

TEST(ImageFiles, UnreadableDirectoryIsAnIoError) {
  const ScratchDirectory scratch;
  std::filesystem::create_symlink(scratch / "loop", scratch / "loop");
  EXPECT_EQ(error_of(scratch / "loop").kind(), ErrorKind::kIo);
  EXPECT_THAT(error_of(scratch / "loop").what(), HasSubstr("Too many levels of symbolic links"));
}

TEST(NaturalLess, OrdersNumbersByTheirValue) {
  EXPECT_TRUE(natural_less("img9", "img10"));
  EXPECT_FALSE(natural_less("img10", "img9"));
  EXPECT_TRUE(natural_less("a2b10", "a10b2"));
  EXPECT_TRUE(natural_less("img", "img0"));
  EXPECT_TRUE(natural_less("007", "8"));
  EXPECT_TRUE(natural_less("99999999999999999999998", "99999999999999999999999"));
}

TEST(NaturalLess, IsAStrictOrderOfDifferentNames) {
  const std::vector<std::string> sorted{"", "1", "01", "2", "10", "a", "a1", "a01", "a1b", "b"};
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    for (std::size_t j = 0; j < sorted.size(); ++j) {
      EXPECT_EQ(natural_less(sorted[i], sorted[j]), i < j) << sorted[i] << " " << sorted[j];
    }
  }
}

}  // namespace
}  // namespace striper
