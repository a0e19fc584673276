// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr std::array<std::string_view, 6> kSchemes{"images", "mcap", "sim", "v4l2", "gige", "u3v"};

std::string guess_scheme(std::string_view path) {
  if (path.ends_with(".yaml") || path.ends_with(".yml")) return "sim";
  if (path.ends_with(".mcap")) return "mcap";
  if (path.starts_with("/dev/")) return "v4l2";
  return "images";
}

}  // namespace

SourceUri SourceUri::parse(std::string_view text) {
  if (text.empty())
    throw Error(ErrorKind::kUsage, "the source is empty: name a directory, file or device");
  SourceUri uri("source", text);
  const std::string_view address = uri.address();
  const std::string_view prefix = scheme_word(address);
  if (std::find(kSchemes.begin(), kSchemes.end(), prefix) != kSchemes.end()) {
    uri.scheme_ = prefix;
    uri.path_ = address.substr(prefix.size() + 1);
  } else if (!prefix.empty()) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("source '{}': unknown kind '{}'; there are {} (a path that contains a colon is "
                    "written images:PATH)",
                    text, prefix, fmt::join(kSchemes, ", ")));
  } else {
    uri.scheme_ = guess_scheme(address);
    uri.path_ = address;
  }
  return uri;
}

}  // namespace striper
