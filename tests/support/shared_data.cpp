// SPDX-License-Identifier: Apache-2.0
#include "support/shared_data.hpp"

namespace striper::testing {

std::filesystem::path source_path(const std::string& relative) {
  return std::filesystem::path(STRIPER_SOURCE_DIR) / relative;
}

std::filesystem::path real_data(const std::string& set) {
  return std::filesystem::path(STRIPER_SHARED_DIR) / "realdata" / set;
}

}  // namespace striper::testing
