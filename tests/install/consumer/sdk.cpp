// SPDX-License-Identifier: Apache-2.0
// Reads a model that is wrong, with the sdk alone.
#include <cstdio>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>

int main() {
  try {
    striper::parse_model("striper_model: 2", "future.yaml");
  } catch (const striper::Error& error) {
    std::printf("%s\n", error.what());
    return 0;
  }
  return 1;
}
