// SPDX-License-Identifier: Apache-2.0
// Proves that a file of whole pieces holds none that is cut, whatever the disk takes, and goes on
// behind the last whole one. A full disk is played by a limit to the size of files.
#include <csignal>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <striper/core/append_file.hpp>

#include "support/error_of.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

// Files cannot grow beyond this while it lives.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

class AppendFileTest : public ::testing::TestWithParam<AppendFile::Mode> {
 protected:
  std::string content() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  testing::ScratchDirectory directory_;
  std::string path_ = (directory_ / "file").string();
};

INSTANTIATE_TEST_SUITE_P(Modes, AppendFileTest,
                         ::testing::Values(AppendFile::Mode::kReplace, AppendFile::Mode::kNew));

TEST_P(AppendFileTest, OfLinesThatDoNotAllFitTheFirstStayWhole) {
  AppendFile file(path_, GetParam());
  {
    const FullDisk disk(14);
    file.lines() = "one\ntwo\nthree\nfour\n";
    const Error error = testing::error_of([&] { file.flush(); });
    EXPECT_EQ(error.kind(), ErrorKind::kIo);
    EXPECT_EQ(error.what(), "cannot write '" + path_ + "': File too large");
  }
  EXPECT_EQ(content(), "one\ntwo\nthree\n");
  file.lines() = "five\n";
  file.close();
  EXPECT_EQ(content(), "one\ntwo\nthree\nfive\n");
}

TEST_P(AppendFileTest, HalfALineIsCutOff) {
  AppendFile file(path_, GetParam());
  {
    const FullDisk disk(6);
    file.lines() = "one\ntwo\n";
    EXPECT_THROW(file.flush(), Error);
  }
  EXPECT_EQ(content(), "one\n");
  file.lines() = "three\n";
  file.flush();
  EXPECT_EQ(content(), "one\nthree\n");
}

TEST_P(AppendFileTest, APieceIsThereWholeOrNotAtAll) {
  AppendFile file(path_, GetParam());
  file.append("abc");
  {
    const FullDisk disk(6);
    EXPECT_THROW(file.append("de\nfgh"), Error);
  }
  EXPECT_EQ(content(), "abc");
  file.append("xyz");
  file.close();
  EXPECT_EQ(content(), "abcxyz");
}

TEST(AppendFile, AFileThatIsThereStaysUnlessItIsToBeReplaced) {
  const testing::ScratchDirectory directory;
  const std::string path = (directory / "file").string();
  AppendFile(path).append("old");
  EXPECT_THROW(AppendFile(path, AppendFile::Mode::kNew), Error);
  std::string text;
  std::ifstream(path) >> text;
  EXPECT_EQ(text, "old");
}

}  // namespace
}  // namespace striper
