// SPDX-License-Identifier: Apache-2.0
// Proves that a file which is kept has the newest text, that giving it one waits for no disk, and
// that what fails is told. The thread sanitizer runs this too.
#include "guide/live/kept_file.hpp"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>

#include "support/scratch_directory.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;

TEST(KeptFile, HasTheNewestText) {
  const testing::ScratchDirectory scratch;
  const auto path = scratch.path() / "job.json";
  {
    KeptFile file(path);
    for (int i = 0; i <= 1000; ++i) file.put(std::to_string(i));
  }
  EXPECT_EQ(read_text_file(path.string(), "a text"), "1000");
  KeptFile file(path);
  file.put("before");
  file.close("last");
  EXPECT_EQ(read_text_file(path.string(), "a text"), "last");
}

TEST(KeptFile, TellsWhatFailsAndWritesAgainOnceItCan) {
  const testing::ScratchDirectory scratch;
  const auto directory = scratch.path() / "not-yet";
  KeptFile file(directory / "job.json");
  file.put("one");
  std::optional<std::string> failure;
  while (!(failure = file.take_failure())) std::this_thread::sleep_for(1ms);
  EXPECT_NE(failure->find("job.json"), std::string::npos) << *failure;
  EXPECT_THROW(file.close("two"), Error);
  std::filesystem::create_directory(directory);
  KeptFile again(directory / "job.json");
  again.close("three");
  EXPECT_EQ(read_text_file((directory / "job.json").string(), "a text"), "three");
}

}  // namespace
}  // namespace striper::program
