// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/text_file.hpp>

namespace striper {
namespace {

constexpr std::size_t kMostBytes = std::size_t{16} << 20;

}  // namespace

std::string read_text_file(const std::filesystem::path& path, std::string_view expected) {
  const auto fail = [&](ErrorKind kind, std::string_view what) {
    throw Error(kind, fmt::format("{}: {} - expected {}", path.string(), what, expected));
  };
  const auto fail_to_read = [&](int reason) {
    fail(ErrorKind::kIo,
         fmt::format("cannot be read: {}", std::generic_category().message(reason)));
  };
  std::error_code failure;
  const bool is_there = std::filesystem::exists(path, failure);
  if (failure) fail_to_read(failure.value());
  if (!is_there) fail(ErrorKind::kNotFound, "there is no such file");
  if (std::filesystem::is_directory(path, failure)) fail(ErrorKind::kBadFile, "is a directory");
  std::ifstream file(path, std::ios::binary);
  if (!file) fail_to_read(errno);
  std::string text(kMostBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) fail_to_read(errno);
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMostBytes)
    fail(ErrorKind::kBadFile, fmt::format("is larger than {} MiB", kMostBytes >> 20));
  return text;
}

}  // namespace striper
