// SPDX-License-Identifier: Apache-2.0
#include "options/own_files.hpp"

#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::program {
namespace {

namespace fs = std::filesystem;

bool is_file_or_new(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return !fs::exists(status) || fs::is_regular_file(status);
}

bool are_one(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  if (fs::equivalent(a, b, ignored)) return true;
  return fs::weakly_canonical(a, ignored) == fs::weakly_canonical(b, ignored);
}

}  // namespace

void require_own_files(const std::vector<std::string>& read,
                       const std::vector<std::string>& written) {
  std::vector<fs::path> taken;
  for (const fs::path file : written) {
    if (file == "-" || file.empty() || !is_file_or_new(file)) continue;
    for (const std::string& input : read) {
      if (are_one(file, input))
        throw Error(ErrorKind::kUsage,
                    fmt::format("'{}' is read: name another file to write", file.string()));
    }
    for (const fs::path& other : taken) {
      if (are_one(file, other))
        throw Error(ErrorKind::kUsage,
                    fmt::format("'{}' is written twice: name two files", file.string()));
    }
    taken.push_back(file);
  }
}

}  // namespace striper::program
