// SPDX-License-Identifier: Apache-2.0
// Whatever bytes a scene file has, parse_scene gives a scene or throws Error{kBadFile}. Seeds:
// data/scenes.
#include <cstdint>
#include <cstdlib>
#include <string>

#include <striper/core/error.hpp>
#include <striper/simulator/scene_yaml.hpp>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    striper::parse_scene(std::string(data, data + size), "fuzz.yaml");
  } catch (const striper::Error& error) {
    if (error.kind() != striper::ErrorKind::kBadFile) std::abort();
  }
  return 0;
}
