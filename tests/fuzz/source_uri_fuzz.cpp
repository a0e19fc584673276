// SPDX-License-Identifier: Apache-2.0
// Whatever text a source's address is, SourceUri::parse takes it apart, or throws Error{kUsage},
// and so do the functions that take its values.
#include <cstdint>
#include <cstdlib>
#include <string>

#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/core/illumination_pattern.hpp>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  try {
    striper::SourceUri uri = striper::SourceUri::parse(text);
    if (uri.text() != text || uri.scheme().empty()) std::abort();
    if (text.find(uri.path()) == std::string::npos) std::abort();
    if (const auto laser = uri.take("laser")) {
      const striper::IlluminationPattern pattern = striper::IlluminationPattern::parse(*laser);
      if (!(striper::IlluminationPattern::parse(pattern.to_string()) == pattern)) std::abort();
    }
    uri.take_number("fps", 0.0, 1e6);
    uri.take_integer("frames", 0, 1000);
    uri.take_bool("realtime");
    uri.refuse_unused("fps, frames, laser, realtime");
  } catch (const striper::Error& error) {
    if (error.kind() != striper::ErrorKind::kUsage) std::abort();
  }
  return 0;
}
