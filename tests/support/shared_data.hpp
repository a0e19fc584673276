// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

namespace striper::testing {

/// A file or folder of this project's sources, `data/scenes/room.yaml` for example.
std::filesystem::path source_path(const std::string& relative);

/// A set of real images in the optional folder of extra test data beside the project.
std::filesystem::path real_data(const std::string& set);

/// What is in a file that gzip has packed.
std::string unpacked(const std::filesystem::path& path);

}  // namespace striper::testing

/// Skips the test, saying so, where a set of real images is absent.
#define STRIPER_SKIP_WITHOUT_REAL_DATA(set)                       \
  if (!std::filesystem::exists(striper::testing::real_data(set))) \
  GTEST_SKIP() << "no real images at " << striper::testing::real_data(set).string()
