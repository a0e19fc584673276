// SPDX-License-Identifier: Apache-2.0
// Proves that a text file is read as it is, to the byte, and that what is none is refused with its
// name, the reason and what was expected. That a file appears whole under its name, or where the
// links of its name lead, with the permissions that it has or any new one gets; that pipes are
// written straight; that a file of another kind is not replaceable; and that what cannot be written
// is told of beforehand, in the same words, without a trace. That the old file stays where writing
// fails is proven on a full disk by end_to_end/command_line_test.py.
#include <array>
#include <filesystem>
#include <iterator>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>

#include "support/error_of.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

namespace fs = std::filesystem;
using testing::read_bytes;

class AtomicFile : public ::testing::Test {
 protected:
  std::ptrdiff_t files() const {
    return std::distance(fs::directory_iterator(scratch_.path()), fs::directory_iterator());
  }

  testing::ScratchDirectory scratch_;
};

TEST_F(AtomicFile, ReplacesWhatIsThere) {
  const fs::path path = scratch_ / "file";
  write_file_atomically(path, "a long text");
  write_file_atomically(path, "text");
  EXPECT_EQ(read_bytes(path), "text");
  EXPECT_EQ(files(), 1) << "no temporary file stays behind";
}

TEST_F(AtomicFile, NewOneHasThePermissionsOfAnyNewFile) {
  const fs::path path = scratch_ / "new";
  const mode_t old_mask = ::umask(0027);
  write_file_atomically(path, "text");
  ::umask(old_mask);
  EXPECT_EQ(fs::status(path).permissions(), fs::perms(0640));
}

TEST_F(AtomicFile, ReplacesTheTargetOfLinksAndKeepsItsPermissions) {
  fs::create_directory(scratch_ / "away");
  const fs::path target = scratch_ / "away/target";
  testing::write_bytes(target, "old");
  fs::permissions(target, fs::perms(0640));
  fs::create_symlink("target", scratch_ / "away/near");
  fs::create_symlink("away/near", scratch_ / "link");
  write_file_atomically(scratch_ / "link", "new");
  EXPECT_TRUE(fs::is_symlink(scratch_ / "link"));
  EXPECT_TRUE(fs::is_symlink(scratch_ / "away/near"));
  EXPECT_EQ(read_bytes(target), "new");
  EXPECT_EQ(fs::status(target).permissions(), fs::perms(0640));
}

TEST_F(AtomicFile, MakesTheTargetThatALinkLacks) {
  fs::create_symlink(scratch_ / "target", scratch_ / "link");
  write_file_atomically(scratch_ / "link", "new");
  EXPECT_TRUE(fs::is_symlink(scratch_ / "link"));
  EXPECT_EQ(read_bytes(scratch_ / "target"), "new");
}

TEST_F(AtomicFile, PipesAreWrittenStraight) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  const std::string path = fmt::format("/dev/fd/{}", ends[1]);
  EXPECT_NO_THROW(require_writable(path));
  write_file_atomically(path, "text");
  std::array<char, 16> read{};
  EXPECT_EQ(::read(ends[0], read.data(), read.size()), 4);
  EXPECT_STREQ(read.data(), "text");
  for (const int end : ends) ::close(end);
}

TEST_F(AtomicFile, WhatCannotBeWrittenIsToldBeforehand) {
  fs::create_symlink("round", scratch_ / "about");
  fs::create_symlink("about", scratch_ / "round");
  const fs::path missing = scratch_ / "none/file";
  for (const fs::path& path : {missing, scratch_.path(), scratch_ / "round", fs::path()}) {
    const Error written = testing::error_of([&] { write_file_atomically(path, "text"); });
    EXPECT_EQ(written.kind(), ErrorKind::kIo);
    const Error foreseen = testing::error_of([&] { require_writable(path); });
    EXPECT_STREQ(foreseen.what(), written.what());
  }
  EXPECT_EQ(testing::error_of([&] { require_writable(missing); }).what(),
            missing.string() + ": cannot be written: No such file or directory");
  EXPECT_NO_THROW(require_writable(scratch_ / "possible"));
  EXPECT_EQ(files(), 2) << "it leaves no trace";
}

Error refusal(const std::filesystem::path& path) {
  return testing::error_of([&] { read_text_file(path, "a poem"); });
}

TEST_F(AtomicFile, OnlyWhatIsOfItsKindIsReplaceable) {
  const auto refused = [](const fs::path& path) {
    return std::string(testing::error_of([&] {
                         require_replaceable(path, {"a,b\n", "<svg"}, "plot");
                       }).what());
  };
  for (const char* text : {"", "a,", "a,b\n", "a,b\n1,2\n", "<svg>"}) {
    write_file_atomically(scratch_ / "ours", text);
    EXPECT_NO_THROW(require_replaceable(scratch_ / "ours", {"a,b\n", "<svg"}, "plot")) << text;
  }
  for (const char* text : {"a,c\n", "model: 1\n", "svg"}) {
    write_file_atomically(scratch_ / "other", text);
    EXPECT_EQ(refused(scratch_ / "other"),
              "'" + (scratch_ / "other").string() +
                  "' is there and holds no plot: it is not overwritten; remove it, or name another "
                  "file")
        << text;
  }
  for (const fs::path& path : {scratch_ / "none", scratch_.path(), fs::path("-")})
    EXPECT_NO_THROW(require_replaceable(path, {"a"}, "plot"));
}

TEST(TextFile, IsReadToTheByte) {
  const testing::ScratchDirectory scratch;
  const std::string text("one\r\ntwo\0three\xff", 15);
  testing::write_bytes(scratch / "file", text);
  EXPECT_EQ(read_text_file(scratch / "file", "a poem"), text);
  testing::write_bytes(scratch / "empty", "");
  EXPECT_EQ(read_text_file(scratch / "empty", "a poem"), "");
}

TEST(TextFile, WhatIsNoneIsRefused) {
  const testing::ScratchDirectory scratch;
  const std::string missing = (scratch / "missing").string();
  EXPECT_EQ(refusal(missing).kind(), ErrorKind::kNotFound);
  EXPECT_EQ(refusal(missing).what(), missing + ": there is no such file - expected a poem");
  EXPECT_EQ(refusal(scratch.path()).kind(), ErrorKind::kBadFile);
  EXPECT_EQ(refusal(scratch.path()).what(),
            scratch.path().string() + ": is a directory - expected a poem");
  testing::write_bytes(scratch / "large", std::string((16U << 20U) + 1, ' '));
  EXPECT_EQ(refusal(scratch / "large").kind(), ErrorKind::kBadFile);
  EXPECT_EQ(refusal("/dev/zero").what(),
            std::string("/dev/zero: is larger than 16 MiB - expected a poem"));
}

}  // namespace
}  // namespace striper
