// SPDX-License-Identifier: Apache-2.0
#include "stream/sinks/replaceable.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {

void require_replaceable(const std::string& path,
                         std::initializer_list<std::string_view> beginnings) {
  std::error_code ignored;
  if (path == "-" || !std::filesystem::is_regular_file(path, ignored)) return;
  std::size_t longest = 0;
  for (const std::string_view begin : beginnings) longest = std::max(longest, begin.size());
  std::ifstream file(path, std::ios::binary);
  std::string begin(longest, '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  const bool is_ours =
      begin.empty() || std::any_of(beginnings.begin(), beginnings.end(),
                                   [&](std::string_view one) { return begin.starts_with(one); });
  if (is_ours) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("'{}' is there and holds no scans: it is not overwritten; remove it, or "
                          "name another file",
                          path));
}

}  // namespace striper::detail
