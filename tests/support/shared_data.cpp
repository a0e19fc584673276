// SPDX-License-Identifier: Apache-2.0
#include "support/shared_data.hpp"

#include <cstdio>
#include <memory>
#include <vector>

namespace striper::testing {

std::filesystem::path source_path(const std::string& relative) {
  return std::filesystem::path(STRIPER_SOURCE_DIR) / relative;
}

std::filesystem::path real_data(const std::string& set) {
  return std::filesystem::path(STRIPER_SHARED_DIR) / "realdata" / set;
}

std::string unpacked(const std::filesystem::path& path) {
  const std::string command = "gzip -dc '" + path.string() + "'";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  std::string text;
  std::vector<char> block(65536);
  for (std::size_t size = 1; size > 0;) {
    size = std::fread(block.data(), 1, block.size(), pipe.get());
    text.append(block.data(), size);
  }
  return text;
}

}  // namespace striper::testing
