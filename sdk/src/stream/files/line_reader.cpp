// SPDX-License-Identifier: Apache-2.0
#include "stream/files/line_reader.hpp"

#include <cerrno>
#include <system_error>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {

LineReader::LineReader(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code ignored;
  if (!std::filesystem::exists(path_, ignored)) {
    throw Error(ErrorKind::kNotFound, fmt::format("{}: there is no such file", path_.string()));
  }
  file_.open(path_, std::ios::binary);
  if (!file_ || std::filesystem::is_directory(path_, ignored)) {
    throw Error(ErrorKind::kIo,
                fmt::format("{}: cannot be read: {}", path_.string(),
                            std::generic_category().message(file_ ? EISDIR : errno)));
  }
}

bool LineReader::next(std::string& line) {
  if (!std::getline(file_, line)) {
    if (file_.bad()) throw Error(ErrorKind::kIo, path_.string() + ": cannot be read further");
    return false;
  }
  ++number_;
  is_ended_ = !file_.eof();
  if (line.ends_with('\r')) line.pop_back();
  return true;
}

void LineReader::fail(const std::string& message) const {
  throw Error(ErrorKind::kBadFile, fmt::format("{}:{}: {}", path_.string(), number_, message));
}

}  // namespace striper::detail
