// SPDX-License-Identifier: Apache-2.0
#include "options/sink_arguments.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::program {
namespace {

namespace fs = std::filesystem;

// Of a file that is not there yet only an absolute name is made canonical.
fs::path canonical(const std::string& path) {
  std::error_code ignored;
  return fs::weakly_canonical(fs::absolute(path, ignored), ignored);
}

bool is_same(const SinkUri& a, const SinkUri& b) {
  if (a.path().empty() || b.path().empty()) return a.text() == b.text();  // Of no file.
  return canonical(a.path()) == canonical(b.path());
}

}  // namespace

std::vector<SinkUri> parse_sinks(const std::vector<std::string>& addresses) {
  std::vector<SinkUri> sinks;
  for (const std::string& address : addresses) {
    const SinkUri sink = SinkUri::parse(address);
    const auto earlier = std::find_if(sinks.begin(), sinks.end(),
                                      [&](const SinkUri& other) { return is_same(other, sink); });
    if (earlier != sinks.end()) {
      throw Error(ErrorKind::kUsage, fmt::format("the outputs '{}' and '{}' are the same: each "
                                                 "would overwrite the other",
                                                 earlier->text(), sink.text()));
    }
    sinks.push_back(sink);
  }
  return sinks;
}

}  // namespace striper::program
