// SPDX-License-Identifier: Apache-2.0
// Whatever bytes a model file has, parse_model gives a model that can be saved and read back, or
// throws Error{kBadFile}. Seeds: tests/sdk/model/malformed.
#include <cstdint>
#include <cstdlib>
#include <string>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  striper::StriperModel model;
  try {
    model = striper::parse_model(text, "fuzz.yaml");
  } catch (const striper::Error& error) {
    if (error.kind() != striper::ErrorKind::kBadFile) std::abort();
    return 0;
  }
  const std::string formatted = striper::format_model(model);
  if (striper::format_model(striper::parse_model(formatted, "back.yaml")) != formatted) {
    std::abort();
  }
  return 0;
}
