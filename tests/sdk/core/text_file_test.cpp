// SPDX-License-Identifier: Apache-2.0
// Proves that a text file is read as it is, to the byte, and that what is none is refused with its
// name, the reason and what was expected.
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/core/text_file.hpp>

#include "support/error_of.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

Error refusal(const std::filesystem::path& path) {
  return testing::error_of([&] { read_text_file(path, "a poem"); });
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
